"""Searches of a front: each begins when the one whose plan it begins with is finished, and is kept on disk."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from missions.arrays import Array
from missions.schema import Mission
from planner.pareto.episodes import beaten_episodes
from planner.pareto.front import FrontPoint, Maps, weighed
from planner.pareto.simplex import Episode
from planner.pareto.store import PlanStore
from planner.plan import Plan

POLL = 0.5  # [s] how often should_stop is asked while searches are under way

Found = tuple[Plan | None, str]


@dataclass(frozen=True)
class FrontProgress:
    """Where it stands: ``done`` of ``total`` searches, as far as they are known; the last vector found."""

    done: int
    total: int
    vector: Array | None = None


class Executor(Protocol):
    """Runs calls somewhere."""

    def submit(self, call: Callable[..., Found], /, *args: object) -> Future[Found]:
        """Hand in a call."""


@dataclass
class Work:
    """Episodes and what became of them; ``results[i]`` is that of ``episodes[i]``, None until it is finished."""

    mission: Mission
    maps: Maps
    store: PlanStore
    executor: Executor
    workers: int
    progress: Callable[[FrontProgress], None] | None
    should_stop: Callable[[], bool] | None
    episodes: list[Episode] = field(default_factory=list)
    results: list[Found | None] = field(default_factory=list)
    keys: list[str] = field(default_factory=list)
    vectors: dict[int, Array] = field(default_factory=dict)
    expected: int = 0

    @property
    def stopped(self) -> bool:
        """Whether somebody wants it to end."""
        return self.should_stop is not None and self.should_stop()

    def run(self, fresh: Sequence[Episode]) -> None:
        """Run episodes, each as soon as the one it begins with is finished; parents are indices into all episodes."""
        waiting = list(range(len(self.episodes), len(self.episodes) + len(fresh)))
        for episode in fresh:
            parent = "" if episode.parent is None else self.keys[episode.parent]
            self.episodes.append(episode)
            self.keys.append(self.store.key(episode.weights, parent))
            self.results.append(None)
        self.tell(None)
        waiting = [number for number in waiting if not self._known(number)]
        under_way: dict[Future[Found], int] = {}
        while waiting or under_way:
            for number in [i for i in waiting if self._ready(i)][: self.workers - len(under_way)]:
                if self.stopped:
                    waiting = []
                    break
                waiting.remove(number)
                under_way[self.executor.submit(search, self.mission, *self._task(number))] = number
            if not under_way:
                return
            ended, _ = wait(under_way, timeout=POLL, return_when=FIRST_COMPLETED)
            for future in ended:
                self._finish(under_way.pop(future), future.result())

    def mend(self) -> None:
        """Search again, from there, wherever another plan turned out to be clearly better; keep what is better."""
        kept, weights, vectors = self.found()
        if self.stopped or not kept:
            return
        beaten = beaten_episodes(self.maps, weights, vectors)
        if not beaten:
            return
        self.expected += len(beaten)
        first = len(self.episodes)
        self.run([replace(episode, parent=at(kept, episode.parent)) for episode in beaten.values()])
        for again, position in enumerate(beaten, first):
            self._better(kept[position], again)

    def found(self) -> tuple[list[int], Array, Array]:
        """Indices of episodes with a plan, their weights (n, m) and vectors (n, m)."""
        kept = sorted(self.vectors)
        shape = (len(kept), len(self.maps.names))
        weights = np.array([self.episodes[number].weights for number in kept]).reshape(shape)
        return kept, weights, np.array([self.vectors[number] for number in kept]).reshape(shape)

    def points(self) -> tuple[tuple[FrontPoint, ...], tuple[str, ...]]:
        """Points with a plan, in order, and a line for each search that found none."""
        kept, _, _ = self.found()
        position = {number: index for index, number in enumerate(kept)}
        found = []
        for number in kept:
            plan, status = self.results[number] or (None, "")
            if plan is not None:
                parent = self._ancestor(number)
                origin = position.get(parent) if parent is not None else None
                found.append(FrontPoint(self.episodes[number].weights, self.vectors[number], plan, origin, status))
        missing = (
            f"no plan for weights {', '.join(f'{w:.3g}' for w in self.episodes[number].weights)}: {result[1]}"
            for number, result in enumerate(self.results)
            if result is not None and result[0] is None
        )
        return tuple(found), tuple(missing)

    def tell(self, vector: Array | None) -> None:
        """Say where it stands."""
        if self.progress is not None:
            done = sum(result is not None for result in self.results)
            self.progress(FrontProgress(done, max(self.expected, len(self.episodes)), vector))

    def _known(self, number: int) -> bool:
        stored = self.store.load(self.keys[number])
        if stored is not None:
            self._finish(number, stored, fresh=False)
        return stored is not None

    def _ready(self, number: int) -> bool:
        parent = self.episodes[number].parent
        return parent is None or self.results[parent] is not None

    def _task(self, number: int) -> tuple[Array, Plan | None]:
        ancestor = self._ancestor(number)
        result = None if ancestor is None else self.results[ancestor]
        return self.episodes[number].weights, None if result is None else result[0]

    def _ancestor(self, number: int) -> int | None:
        """The nearest episode upwards that has a plan."""
        parent = self.episodes[number].parent
        while parent is not None and parent not in self.vectors:
            parent = self.episodes[parent].parent
        return parent

    def _finish(self, number: int, result: Found, *, fresh: bool = True) -> None:
        self.results[number] = result
        if fresh:
            self.store.save(self.keys[number], *result)
        if result[0] is not None:
            self.vectors[number] = self.maps.vector(result[0].q[:-1])
        self.tell(self.vectors.get(number))

    def _better(self, before: int, again: int) -> None:
        """Of two searches for the same weights, leave the better one's point."""
        if again not in self.vectors:
            return
        weights = self.episodes[before].weights
        worse = before if weights @ self.vectors[again] < weights @ self.vectors[before] else again
        del self.vectors[worse]


def at(kept: Sequence[int], position: int | None) -> int | None:
    """The number of the episode that is at a position among those kept."""
    return None if position is None else kept[position]


def search(mission: Mission, weights: Array, initial: Plan | None) -> Found:
    """What a worker does: a plan for weights of a mission, from another's plan or from scratch, and how it ended.

    Where a plan given leads nowhere, from scratch.
    """
    from planner.problem import build_problem
    from planner.solver.methods import solve

    settings = replace(mission.solver, processes=1, method="fast")
    problem = build_problem(weighed(mission, weights))
    outcome = solve(problem, settings, initial=initial)
    if outcome.plan is None and initial is not None:
        outcome = solve(problem, settings)
    missed = "; ".join(str(violation) for violation in outcome.violations[:2])
    return outcome.plan, f"{outcome.status.value}: {missed}" if missed else outcome.status.value
