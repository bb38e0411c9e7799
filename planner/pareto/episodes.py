"""Which weights are tried: the lattice of the settings first, then wherever the front is thin or a plan is beaten."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from missions.arrays import Array, frozen
from planner.pareto.exchange import best_for
from planner.pareto.front import Front, FrontSettings, Maps
from planner.pareto.ideal import Gap, gaps, ideal_vectors, nadir
from planner.pareto.simplex import (
    DegenerateSimplexError,
    Episode,
    adaptive,
    breadth_first,
    grid,
    with_corners,
)

CANDIDATES = {1: 1, 2: 100, 3: 30, 4: 12, 5: 8, 6: 7}  # divisions of the grid on which gaps are looked for: about 500
WORTH = 1e-5  # share of the whole box's hyper-volume below which a gap is none
BEATEN = 0.05  # of what a plan misses its ideal by: less than that is no reason to search again
_SAME = 1e-9


def first_episodes(maps: Maps, settings: FrontSettings) -> tuple[tuple[Episode, ...], tuple[str, ...]]:
    """The lattice's episodes, and what a reader has to know about them.

    Raises:
        WeightSpaceError: it has too many points.
    """
    count, prefer = len(maps.names), maps.prefer

    def inside(weights: Array) -> bool:
        return settings.radius is None or float(np.abs(weights - prefer).max()) <= settings.radius + _SAME

    if settings.method == "thin" or count == 1:
        ends = [corner for corner in np.eye(count) if inside(corner)]
        ends = [corner for corner in ends if np.abs(corner - prefer).max() > _SAME]
        return (Episode(prefer, None), *(Episode(frozen(corner), 0) for corner in ends)), ()
    if settings.method == "a-sles":
        try:
            lattice = adaptive(maps.distances, settings.step, prefer)
        except DegenerateSimplexError as flat:
            note = f"A-SLES needs maps that differ: {flat}; the regular grid of SLES is used instead"
            return breadth_first(grid(count, settings.step), prefer, inside=inside), (note,)
        episodes = breadth_first(lattice, prefer, inside=inside)
        return (with_corners(episodes, count) if settings.radius is None else episodes), ()
    episodes = breadth_first(grid(count, settings.step), prefer, inside=inside)
    if settings.method == "scalar":
        episodes = tuple(Episode(episode.weights, None) for episode in episodes)
    return episodes, ()


def thin_episodes(
    maps: Maps, settings: FrontSettings, weights: Array, vectors: Array, tried: Array, count: int
) -> tuple[Episode, ...]:
    """Up to ``count`` weights where most is to be gained, each from the plan that is best for it so far.

    Args:
        maps: the mission's.
        settings: their radius limits where is looked.
        weights: (n, m) of the points found.
        vectors: (n, m) their ergodic vectors.
        tried: (k, m) weights that are not tried again, whatever became of them.
        count: at most.
    """
    found = _thinnest(maps, settings.radius, weights, vectors, tried, count)
    return _from_best(np.array([gap.weights for gap in found]).reshape(-1, len(maps.names)), vectors)


def widest_gap(front: Front) -> Gap | None:
    """Where the front is thinnest: weights, and the share of the box up to the worst ends that is to be gained there.

    None if there is hardly anything, or one map only.
    """
    maps = Maps.of(front.mission)
    if len(maps.names) == 1:
        return None
    found = _thinnest(maps, front.settings.radius, front.weights, front.vectors, front.weights, 1)
    return Gap(found[0].weights, found[0].gain / float(nadir(maps.distances).prod())) if found else None


def _thinnest(maps: Maps, radius: float | None, weights: Array, vectors: Array, tried: Array, count: int) -> list[Gap]:
    grid_of = grid(len(maps.names), 1.0 / CANDIDATES[len(maps.names)])
    everywhere = np.array([episode.weights for episode in breadth_first(grid_of, maps.prefer)])
    if radius is not None:
        everywhere = everywhere[np.abs(everywhere - maps.prefer).max(axis=1) <= radius + _SAME]
    fresh = np.abs(everywhere[:, None] - tried[None]).max(axis=2).min(axis=1) > _SAME
    reference = nadir(maps.distances)  # (1, …, 1) may be far below the ends of a front of maps that differ much
    promising = gaps(everywhere[fresh], weights, vectors, maps.distances, count, reference)
    return [gap for gap in promising if gap.gain > WORTH * float(reference.prod())]


def beaten_episodes(maps: Maps, weights: Array, vectors: Array) -> dict[int, Episode]:
    """Points for whose weights another plan is clearly better, and the searches that begin with that plan.

    Local minima differ: what was found from one side need not be found from the other.
    """
    own = np.einsum("nm,nm->n", weights, vectors)
    missed = own - np.einsum("nm,nm->n", weights, ideal_vectors(weights, maps.distances))
    beaten = np.flatnonzero(own - (weights @ vectors.T).min(axis=1) > BEATEN * np.maximum(missed, 0.0) + _SAME)
    return dict(zip(beaten.tolist(), _from_best(weights[beaten], vectors), strict=True))


def _from_best(weights: Array, vectors: Array) -> tuple[Episode, ...]:
    parents: Sequence[int] = best_for(vectors, weights).tolist() if len(weights) else ()
    return tuple(Episode(frozen(w), parent) for w, parent in zip(weights, parents, strict=True))
