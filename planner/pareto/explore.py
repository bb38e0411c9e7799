"""Cover the weight space of a mission: a plan for each of many weightings, in processes, resumable.

What is searched is decided before anything runs or from finished results only, so the front depends neither on the
number of processes nor on who finishes first; with ``solver.time_limit`` it depends on the machine, as every plan does.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from missions.schema import Mission
from planner.feasibility import check_feasible
from planner.pareto.episodes import first_episodes, thin_episodes
from planner.pareto.front import Front, FrontError, FrontSettings, Maps
from planner.pareto.store import PlanStore
from planner.pareto.work import Executor, Found, FrontProgress, Work, at
from planner.pool import worker_pool

ROUND = 4  # plans that are placed at once where the front is thin, whatever the number of processes


def explore(
    mission: Mission,
    settings: FrontSettings | None = None,
    folder: Path | None = None,
    *,
    processes: int | None = None,
    progress: Callable[[FrontProgress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> Front:
    """The front of a mission's maps; of a mission with one map, one plan.

    Args:
        mission: any that can be planned; its weights are where the search begins.
        settings: how the weights are covered.
        folder: where finished searches are kept and looked for; None: nowhere.
        processes: how many at a time; default: as many as there are cores; 0: in this process, one by one.
        progress: called at the start and after every search.
        should_stop: asked twice a second; True ends the work after the searches under way.

    Raises:
        UnreachableError: the mission is provably impossible.
        WeightSpaceError: more plans than make sense.
        FrontError: a worker was killed, no weighting has a plan, or the method is nsga2.
    """
    settings = settings or FrontSettings()
    if settings.method == "nsga2":
        raise FrontError("method nsga2 covers no weights; see planner.pareto.genetic.genetic_front")
    check_feasible(mission)
    maps = Maps.of(mission)
    episodes, notes = first_episodes(maps, settings)
    with _executor(processes) as (executor, workers):
        work = Work(mission, maps, PlanStore(folder, mission), executor, workers, progress, should_stop)
        work.expected = len(episodes) + (settings.extra if len(maps.names) > 1 else 0)
        work.run(episodes)
        work.mend()
        _refine(work, settings)
    points, failures = work.points()
    if not points:
        raise FrontError(f"no weighting has a plan: {failures[0] if failures else 'interrupted before the first'}")
    return Front(mission, settings, maps.names, maps.distances, points, (*notes, *failures))


def _refine(work: Work, settings: FrontSettings) -> None:
    """Plans more where the front is thin, a few at a time, each round knowing of those before it."""
    left = settings.extra if len(work.maps.names) > 1 else 0
    while left > 0 and not work.stopped:
        kept, weights, vectors = work.found()
        if not kept:
            return
        tried = np.array([episode.weights for episode in work.episodes])
        fresh = thin_episodes(work.maps, settings, weights, vectors, tried, min(left, ROUND))
        if not fresh:
            return
        left -= len(fresh)
        work.run([replace(episode, parent=at(kept, episode.parent)) for episode in fresh])
        work.mend()


class _Inline:
    """Runs what is handed in at once, in this process."""

    def submit(self, call: Callable[..., Found], /, *args: object) -> Future[Found]:
        future: Future[Found] = Future()
        future.set_result(call(*args))
        return future


@contextmanager
def _executor(processes: int | None) -> Iterator[tuple[Executor, int]]:
    if processes == 0:
        yield _Inline(), 1
        return
    workers = processes or os.cpu_count() or 1
    with worker_pool(workers, FrontError) as pool:
        yield pool, workers
