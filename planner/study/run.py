"""Run a study: what is missing, in processes, each result in a file of its own as soon as it is there."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable, Generator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from planner.pool import worker_pool
from planner.study.record import COLUMNS, Run, Study, StudyError
from planner.study.worker import Result, measure

POLL = 0.5  # [s] how often should_stop is asked while runs are under way


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

    Raises:
        StudyError: a worker process was killed.
    """
    folder = Path(folder)
    (folder / "runs").mkdir(parents=True, exist_ok=True)
    runs = study.runs()
    missing = [run for run in {run.key: run for run in runs}.values() if _result(folder, run) is None]
    done = total = len({run.key for run in runs})
    done -= len(missing)
    if progress is not None:
        progress(StudyProgress(done, total))
    stop = should_stop or (lambda: False)
    search = _inline(study, missing, stop) if processes == 0 else _parallel(study, missing, stop, processes)
    with closing(search) as results:  # workers end with it, whatever comes
        for run, result in results:
            result["version"] = study.decisive.get("version", "")
            _write(_file(folder, run), json.dumps(result, sort_keys=True))
            done += 1
            if progress is not None:
                progress(StudyProgress(done, total, run, result))
    return _table(study, runs, folder)


def _inline(study: Study, missing: list[Run], stop: Callable[[], bool]) -> Generator[tuple[Run, Result], None, None]:
    for run in missing:
        if stop():
            return
        yield run, measure(run.mission, study.folder, study.stage)


def _parallel(
    study: Study, missing: list[Run], stop: Callable[[], bool], processes: int | None
) -> Generator[tuple[Run, Result], None, None]:
    """As they end. No more are handed out than run at a time, so that a stop waits for little."""
    workers = min(processes or os.cpu_count() or 1, max(len(missing), 1))
    waiting = iter(missing)
    under_way: dict[Future[Result], Run] = {}
    with worker_pool(workers, StudyError) as pool:
        while True:
            while len(under_way) < workers and not stop() and (run := next(waiting, None)) is not None:
                under_way[pool.submit(measure, run.mission, study.folder, study.stage)] = run
            if not under_way:
                return
            ended, _ = wait(under_way, timeout=POLL, return_when=FIRST_COMPLETED)
            for future in ended:
                yield under_way.pop(future), future.result()


def _file(folder: Path, run: Run) -> Path:
    return folder / "runs" / f"{run.key}.json"


def _result(folder: Path, run: Run) -> Result | None:
    """A run's result; None if it has none yet, or one that a crashed disk left unreadable."""
    try:
        result = json.loads(_file(folder, run).read_text(encoding="utf-8"))
    except (FileNotFoundError, UnicodeDecodeError, json.JSONDecodeError):
        return None
    return result if isinstance(result, dict) else None


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
            if (result := _result(folder, run)) is not None:
                point = [run.point[axis] for axis in study.sweep]
                writer.writerow([*point, run.seed, *(result.get(column, "") for column in COLUMNS)])
    os.replace(beside, path)
    return path
