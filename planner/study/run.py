"""Run a study: what is missing, in processes, each result in a file of its own as soon as it is there."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from planner.study.record import Run, Study
from planner.study.worker import Result, measure, one_thread_each

POLL = 0.5  # [s] how often should_stop is asked while runs are under way
COLUMNS = (
    "feasible", "status", "ergodicity", "connection_ratio", "probability", "probability_worst", "all_met",
    "separation", "clearance", "violation", "cpu_s", "evaluations", "message",
)  # fmt: skip


@dataclass(frozen=True)
class StudyProgress:
    """Where a study stands: ``done`` of ``total`` runs; the run that just ended and its result."""

    done: int
    total: int
    run: Run | None = None
    result: Mapping[str, object] | None = None


def run_study(
    study: Study,
    folder: str | Path,
    *,
    processes: int | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> Path:
    """Run what has not run yet and write the table.

    A run's result is a file ``runs/<hash of all that decides it>.json``, written at once and whole, so a study that
    was killed goes on where it stopped, and a changed study runs only what changed.

    Args:
        study: what to run.
        folder: where results go; made if absent.
        processes: how many at a time; default: as many as there are cores; 0: in this process, one by one.
        progress: called at the start and after every run.
        should_stop: asked twice a second; True ends the study after the runs under way.

    Returns:
        The table: ``<name>.csv``, one row a run that has a result, in the grid's order.
    """
    folder = Path(folder)
    (folder / "runs").mkdir(parents=True, exist_ok=True)
    runs = study.runs()
    missing = [run for run in {run.key: run for run in runs}.values() if not _file(folder, run).exists()]
    done = total = len({run.key for run in runs})
    done -= len(missing)
    if progress is not None:
        progress(StudyProgress(done, total))
    stop = should_stop or (lambda: False)
    results = _inline(study, missing, stop) if processes == 0 else _parallel(study, missing, stop, processes)
    for run, result in results:
        _write(_file(folder, run), json.dumps(result, sort_keys=True))
        done += 1
        if progress is not None:
            progress(StudyProgress(done, total, run, result))
    return _table(study, runs, folder)


def _inline(study: Study, missing: list[Run], stop: Callable[[], bool]) -> Iterator[tuple[Run, Result]]:
    for run in missing:
        if stop():
            return
        yield run, measure(run.mission, study.folder, study.stage)


def _parallel(
    study: Study, missing: list[Run], stop: Callable[[], bool], processes: int | None
) -> Iterator[tuple[Run, Result]]:
    """As they end. No more are handed out than run at a time, so that a stop waits for little."""
    workers = min(processes or os.cpu_count() or 1, max(len(missing), 1))
    waiting = iter(missing)
    under_way: dict[Future[Result], Run] = {}
    with _pool(workers) as pool:
        while True:
            while len(under_way) < workers and not stop() and (run := next(waiting, None)) is not None:
                under_way[pool.submit(measure, run.mission, study.folder, study.stage)] = run
            if not under_way:
                return
            ended, _ = wait(under_way, timeout=POLL, return_when=FIRST_COMPLETED)
            for future in ended:
                yield under_way.pop(future), future.result()


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    # Spawned, not forked: a fork of a process with threads can hang.
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=one_thread_each)
    try:
        yield pool
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _file(folder: Path, run: Run) -> Path:
    return folder / "runs" / f"{run.key}.json"


def _write(path: Path, text: str) -> None:
    """Whole or not at all."""
    beside = path.with_suffix(f".{os.getpid()}.tmp")
    beside.write_text(text, encoding="utf-8")
    os.replace(beside, path)


def _table(study: Study, runs: tuple[Run, ...], folder: Path) -> Path:
    path = folder / f"{study.name}.csv"
    beside = path.with_suffix(f".{os.getpid()}.tmp")
    with beside.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*study.sweep, "seed", *COLUMNS])
        for run in runs:
            if _file(folder, run).exists():
                result = json.loads(_file(folder, run).read_text(encoding="utf-8"))
                point = [run.point[axis] for axis in study.sweep]
                writer.writerow([*point, run.seed, *(result.get(column, "") for column in COLUMNS)])
    os.replace(beside, path)
    return path
