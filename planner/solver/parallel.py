"""Searches in several processes at once; the best plan wins.

Every process has starts of its own, drawn from the mission's seed and its number, so that the outcome depends on the
settings alone, as long as no deadline ends it. Processes are spawned, not forked: the caller may have threads. As
always with spawned processes, a script has to call this from under ``if __name__ == "__main__"``.
"""

from __future__ import annotations

import multiprocessing
import queue
import signal
import time
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor, wait
from dataclasses import replace
from multiprocessing.queues import Queue
from multiprocessing.synchronize import Event
from typing import NamedTuple

from missions.schema import SolverSettings
from planner.problem import Problem
from planner.solver import augmented_lagrangian as al
from planner.solver.result import Progress, SolveOutcome
from planner.solver.search import Search, search_cold

POLL = 0.1  # [s] between looks at progress and interruption


class Found(NamedTuple):
    """What one process found: an order among outcomes, smallest best, and the outcome."""

    key: tuple[float, ...]
    process: int
    outcome: SolveOutcome


def solve_parallel(
    problem: Problem,
    settings: SolverSettings,
    schedule: al.Schedule,
    progress: Callable[[Progress], None] | None,
    should_stop: Callable[[], bool] | None,
) -> SolveOutcome:
    """``settings.processes`` searches at once, with one deadline. Progress is the first process's.

    Whatever is raised here, a second Ctrl-C above all, ends the processes at once.
    """
    deadline = time.time() + settings.time_limit
    context = multiprocessing.get_context("spawn")
    told, stop = context.Queue(), context.Event()
    others = set(multiprocessing.active_children())
    with ProcessPoolExecutor(settings.processes, context, _prepare, (told, stop)) as pool:
        futures = [
            pool.submit(_search, problem, settings, schedule, deadline, stream) for stream in range(settings.processes)
        ]
        try:
            _watch(futures, told, stop, progress, should_stop)
        except BaseException:
            for process in set(multiprocessing.active_children()) - others:
                process.terminate()
            raise
        found = [future.result() for future in futures]
    best = min(found, key=lambda item: (item.key, item.process)).outcome
    if best.plan is None:
        return best
    plans = [item.outcome.history[-1] for item in found if item.outcome.history]
    plan = replace(
        best.plan,
        evaluations=sum(entry.evaluations for entry in plans),
        seconds=sum(entry.seconds for entry in plans),
    )
    return replace(best, plan=plan)


def _watch(
    futures: list[Future[Found]],
    told: Queue[Progress],
    stop: Event,
    progress: Callable[[Progress], None] | None,
    should_stop: Callable[[], bool] | None,
) -> None:
    """Pass progress on and interruptions down until every search has ended."""
    running = set(futures)
    while running:
        running = wait(running, timeout=POLL).not_done
        if should_stop is not None and should_stop():
            stop.set()
        while True:
            try:
                entry = told.get_nowait()
            except queue.Empty:
                break
            if progress is not None:
                progress(entry)


# What the parent handed to this process.
_told: Queue[Progress] | None = None
_stop: Event | None = None


def _prepare(told: Queue[Progress], stop: Event) -> None:
    """Set a worker up. Ctrl-C is for the parent, which asks the workers to stop and takes what they have."""
    global _told, _stop
    _told, _stop = told, stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _search(problem: Problem, settings: SolverSettings, schedule: al.Schedule, deadline: float, process: int) -> Found:
    """One process's search."""
    left = replace(settings, time_limit=max(deadline - time.time(), 1e-3))
    tell = _told.put if process == 0 and _told is not None else None
    search = Search(problem, left, schedule, tell, _stop.is_set if _stop is not None else None, stream=process)
    outcome = search_cold(search)
    key = (0.0, *search.best.key) if outcome.plan is not None and search.best is not None else _distance(outcome)
    return Found(key, process, outcome)


def _distance(outcome: SolveOutcome) -> tuple[float, ...]:
    """Order among outcomes without a plan: by their worst violation."""
    return (1.0, outcome.history[-1].violation_m if outcome.history else float("inf"))
