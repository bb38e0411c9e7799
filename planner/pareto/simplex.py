"""Where weights are tried: points of the weight space B = {w ≥ 0, Σ w = 1} and which are next to each other.

SLES (Ren, Srinivasan, Coffin, Abraham, Choset: Multi-objective ergodic search) covers B step by step from a first
weighting; A-SLES takes its steps in a simplex whose edges are as long as the maps are different, so that similar maps
get few weightings.
"""

from __future__ import annotations

import itertools
import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from missions.arrays import Array, frozen
from planner.errors import PlannerError

MOST_EPISODES = 5000
FLATTEST = 1e-3  # height of a simplex over its longest edge from which on it counts as flat
_INSIDE = 1e-9

Key = tuple[int, ...]


class WeightSpaceError(PlannerError):
    """The weight space cannot be covered as asked; the message says what to change."""


class DegenerateSimplexError(WeightSpaceError):
    """Maps lie on a line, or in fewer dimensions than they should: A-SLES's affine map does not exist."""


class Lattice(Protocol):
    """Points of the weight space, by integer coordinates."""

    def weights(self, key: Key) -> Array:
        """(m,) weights of a point."""

    def neighbours(self, key: Key) -> list[Key]:
        """The points a step away that are in the weight space, always in the same order."""

    def nearest(self, weights: Array) -> Key:
        """The point to begin with: at given weights, or the one nearest to them."""


@dataclass(frozen=True)
class Episode:
    """One search: the weights it is for, and the earlier episode whose plan it starts from (None: from scratch)."""

    weights: Array
    parent: int | None


@dataclass(frozen=True)
class RegularGrid:
    """All weights that are multiples of 1/divisions: the regular grid of a simplex of any dimension, corners included.

    Attributes:
        maps: m. divisions: steps from corner to corner.
    """

    maps: int
    divisions: int

    def weights(self, key: Key) -> Array:
        """(m,) weights of a point."""
        return frozen(np.array(key) / self.divisions)

    def neighbours(self, key: Key) -> list[Key]:
        """A step's worth of weight from one map to another."""
        found = []
        for source, target in itertools.permutations(range(self.maps), 2):
            if key[source] > 0:
                moved = list(key)
                moved[source] -= 1
                moved[target] += 1
                found.append(tuple(moved))
        return found

    def nearest(self, weights: Array) -> Key:
        """By largest remainders."""
        scaled = np.asarray(weights) * self.divisions
        counts = np.floor(scaled + _INSIDE).astype(int)
        for index in np.argsort(counts - scaled, kind="stable")[: self.divisions - counts.sum()]:
            counts[index] += 1
        return tuple(int(count) for count in counts)


@dataclass(frozen=True)
class AdaptiveLattice:
    """A square lattice in the simplex B' whose edges are as long as the maps are different (A-SLES).

    Attributes:
        corners: (m, m−1) of B', in units of the maps' distance. step: d', in the same unit.
        origin: (m−1,) of the lattice.
    """

    corners: Array
    step: float
    origin: Array

    def weights(self, key: Key) -> Array:
        """(m,) weights of a point: its barycentric coordinates, A_w of the paper."""
        return frozen(np.clip(self._barycentric(key), 0.0, None))

    def neighbours(self, key: Key) -> list[Key]:
        """A step along each axis, both ways, as far as that is inside."""
        found = []
        for axis, sign in itertools.product(range(len(key)), (1, -1)):
            moved = list(key)
            moved[axis] += sign
            if self._barycentric(tuple(moved)).min() >= -_INSIDE:
                found.append(tuple(moved))
        return found

    def nearest(self, weights: Array) -> Key:
        """The lattice begins where the search does: its origin."""
        return (0,) * len(self.origin)

    def _barycentric(self, key: Key) -> Array:
        return barycentric(self.corners, self.origin + self.step * np.array(key))


def grid(maps: int, step: float) -> RegularGrid:
    """The regular grid with about this step.

    Raises:
        WeightSpaceError: it has too many points.
    """
    divisions = max(1, round(1.0 / step))
    count = math.comb(divisions + maps - 1, maps - 1)
    if count > MOST_EPISODES:
        allowed = f"at most {MOST_EPISODES}; take larger steps, or fewer maps"
        raise WeightSpaceError(f"steps of {step:g} over {maps} maps are {count} plans; allowed: {allowed}")
    return RegularGrid(maps, divisions)


def adaptive(distances: Array, step: float, begin: Array) -> AdaptiveLattice:
    """A-SLES's lattice through the weights ``begin``, for ``distances`` (m, m) between maps.

    Raises:
        DegenerateSimplexError: the maps' simplex is flat.
        WeightSpaceError: it has too many points.
    """
    corners = embedded(distances)
    cells = float(np.prod([corner[axis] for axis, corner in enumerate(corners[1:])]))
    cells /= math.factorial(len(corners) - 1) * step ** (len(corners) - 1)
    if cells > MOST_EPISODES:
        allowed = f"at most {MOST_EPISODES}; take larger steps"
        raise WeightSpaceError(f"steps of {step:g} between these maps are about {cells:.0f} plans; allowed: {allowed}")
    return AdaptiveLattice(frozen(corners), step, frozen(np.asarray(begin) @ corners))


def embedded(distances: Array) -> Array:
    """(m, m−1) corners with given ``distances`` (m, m): the first at 0, the second on the first axis, and so on.

    Raises:
        DegenerateSimplexError: there is no such simplex, or it is flat: two maps are the same, three on a line, …
    """
    squared = np.asarray(distances, dtype=np.float64) ** 2
    gram = 0.5 * (squared[1:, :1] + squared[:1, 1:] - squared[1:, 1:])  # inner products of the edges at corner 0
    flattest = FLATTEST * math.sqrt(max(float(squared.max()), 0.0))
    corners = np.zeros((len(squared), len(gram)))
    for row in range(len(gram)):
        for axis in range(row):
            known = float(corners[row + 1, :axis] @ corners[axis + 1, :axis])
            corners[row + 1, axis] = (gram[row, axis] - known) / corners[axis + 1, axis]
        height = float(gram[row, row] - corners[row + 1, :row] @ corners[row + 1, :row])
        if not height > flattest**2:
            raise DegenerateSimplexError(
                f"map {row + 2} adds nothing to those before it (height {math.sqrt(max(height, 0.0)):.2g}): "
                "their differences span no simplex"
            )
        corners[row + 1, row] = math.sqrt(height)
    return corners


def barycentric(corners: Array, point: Array) -> Array:
    """(m,) weights of the corners (m, m−1) that make up a ``point`` (m−1,); negative outside; they sum to 1."""
    rest = np.linalg.solve((corners[1:] - corners[0]).T, point - corners[0])
    return np.concatenate(([1.0 - rest.sum()], rest))


def breadth_first(
    lattice: Lattice, begin: Array, *, inside: Callable[[Array], bool] | None = None
) -> tuple[Episode, ...]:
    """SLES, Algorithm 1: every point of a lattice, each reached from the neighbour that was first to see it.

    Args:
        lattice: the points.
        begin: (m,) weights to begin at.
        inside: which weights to take; others are not gone beyond either. Default: all.

    Raises:
        WeightSpaceError: too many.
    """
    first = lattice.nearest(begin)
    seen, open_ = {first}, deque[tuple[Key, int | None]]([(first, None)])
    episodes: list[Episode] = []
    while open_:
        key, parent = open_.popleft()
        episodes.append(Episode(lattice.weights(key), parent))
        if len(episodes) > MOST_EPISODES:
            raise WeightSpaceError(f"more than {MOST_EPISODES} plans; take larger steps, or fewer maps")
        for neighbour in lattice.neighbours(key):
            if neighbour in seen or (inside is not None and not inside(lattice.weights(neighbour))):
                continue
            seen.add(neighbour)
            open_.append((neighbour, len(episodes) - 1))
    return tuple(episodes)


def with_corners(episodes: Sequence[Episode], maps: int) -> tuple[Episode, ...]:
    """The episodes and one for each map alone, which a square lattice misses: the ends of the front."""
    found = list(episodes)
    for corner in np.eye(maps):
        nearness = [float(np.abs(episode.weights - corner).max()) for episode in episodes]
        parent = int(np.argmin(nearness))
        if nearness[parent] > _INSIDE:
            found.append(Episode(frozen(corner), parent))
    return tuple(found)
