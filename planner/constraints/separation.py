"""Robots keep apart: |q_i(t) − q_j(t)| ≥ ε_a (IMEC, Eq. 9e), at every instant.

Distances may count less along an axis, which makes the sphere around a robot an ellipsoid: downwash reaches farther
down than aside.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.constraints.base import Evaluation, Place, Rows, stacked_pairs
from planner.constraints.blocks import BLOCK, box_gaps, spans_of
from planner.constraints.paths import (
    EXACT,
    SEARCHED,
    Closest,
    Indices,
    Paths,
    When,
    acting,
    closest,
    near_origin,
    place_at,
    push,
)
from planner.dynamics import Cotangent, Motion

FAR = 1.5  # limits of distance from which on it does not matter how far
MANY_PAIRS = 150  # from which on it is worth looking at boxes of single samples first


@dataclass(frozen=True)
class Separation:
    """g = (ε² − d²)/(2 ε) at the closest approach of a step: metres to first order at the limit.

    Attributes:
        pairs: (P, 2) robot indices.
        distance: (P,) smallest distance allowed [m].
        names: of all robots. dt: planning step [s].
        scale: (ν,) by how much distance counts along each axis; None: fully.
        when: at every instant, along chords, at samples, or at the end only, from where a robot descends.
    """

    pairs: NDArray[np.intp]
    distance: Array
    names: tuple[str, ...]
    dt: float
    scale: Array | None = None
    when: When = When.ALWAYS
    name: str = "separation"
    unit: str = "m"
    tolerance: float = 1e-3
    swarm_axis: int = 0

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (P, K) over the steps (or samples).

        Constant, and far below zero, from ``FAR`` limits of distance on.
        """
        paths = self._paths(motion)
        squares, at = self._closest(paths)
        epsilon = self.distance[:, None]
        squares *= -0.5 / epsilon
        squares += 0.5 * epsilon

        def pull(weights: Array, cotangent: Cotangent) -> None:
            p, k = acting(weights, at)  # few pairs are close at any time
            _, samples, share, (i, j), (force, opposite) = self._rows(paths, at, p, k)
            push(cotangent.q_fine, samples, share, i, force * weights[p, k])
            push(cotangent.q_fine, samples, share, j, opposite * weights[p, k])

        return Evaluation(squares, pull)

    def rows(self, motion: Motion, weights: Array) -> Rows:
        """Gradients of the components whose weight is not zero."""
        paths = self._paths(motion)
        _, at = self._closest(paths)
        return self._rows(paths, at, *acting(weights, at))

    def _rows(self, paths: Paths, at: Array, p: Indices, k: Indices) -> Rows:
        """Gradients of pairs p in spans k."""
        robots = self.pairs[p].T
        share = paths.shares(at[p, k])
        force = place_at(paths.at(robots[1], k) - paths.at(robots[0], k), share)
        force /= self.distance[p]
        if self.scale is not None:
            force *= self.scale[:, None]
        return Rows("q_fine", paths.sample[:, k], share, robots, np.stack([force, -force]))

    def violation(self, motion: Motion) -> Array:
        """ε_a − d [m], (P, K); of pairs that are far apart no less than what says so."""
        missing: Array = self.distance[:, None] - np.sqrt(self._closest(self._paths(motion), EXACT).squares)
        return missing

    def place(self, index: tuple[int, ...]) -> Place:
        """The pair, the step."""
        i, j = self.pairs[index[0]]
        span = self.dt if self.when is When.ALWAYS else 0.5 * self.dt
        return Place(f"{self.names[i]}-{self.names[j]}", index[1] * span if self.when is not When.END else None)

    def stacked(self, swarms: int, robots: int) -> Separation:
        """The same for several swarms."""
        pairs = stacked_pairs(self.pairs, swarms, robots)
        return replace(self, pairs=pairs, distance=np.tile(self.distance, swarms), names=self.names * swarms)

    def _paths(self, motion: Motion) -> Paths:
        paths = Paths.of(motion, self.when)
        return paths if self.scale is None else paths.scaled(self.scale)

    def _closest(self, paths: Paths, parts: int = SEARCHED) -> Closest:
        """Closest approaches (P, K), capped at ``FAR`` limits."""
        i, j = self.pairs.T
        if self.when is not When.ALWAYS and len(self.pairs) < MANY_PAIRS:
            return closest(paths.windows(paths.x.take(i, axis=1) - paths.x.take(j, axis=1)))
        spans = paths.sample.shape[1]
        low, high = paths.boxes(BLOCK)
        gaps = box_gaps(low[:, i], high[:, i], low[:, j], high[:, j])
        reach = FAR * self.distance
        p, blocks = np.nonzero(gaps < reach[:, None] ** 2)
        p, k = spans_of(p, blocks, spans)
        apart = paths.at(i[p], k) - paths.at(j[p], k)
        near = near_origin(apart, reach[p])
        p, k = p[near], k[near]
        squares = np.repeat(reach[:, None] ** 2, spans, axis=1)
        at = np.full_like(squares, np.nan)
        found = closest(apart[:, :, near], parts).capped(reach[p])
        flat = p * spans + k
        squares.ravel()[flat], at.ravel()[flat] = found
        return Closest(squares, at)
