"""Pairs truly meet: in contact at least once in every sub-period."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.connectivity.distances import distances, pull_squares
from planner.constraints.base import Evaluation, Place, stacked_pairs
from planner.constraints.pairwise import Rows, pair_and_sub_period
from planner.dynamics import Cotangent, Motion

SHARPNESS = 0.1  # τ / R²: smaller follows the closest instant alone, larger blends more instants in


@dataclass(frozen=True)
class Meeting:
    """g = (softmin_t d²(t) − R²)/(2 R), in metres to first order at the limit.

    softmin is the Boltzmann mean Σ d² e^(−d²/τ) / Σ e^(−d²/τ): never below the minimum, so g ≤ 0 proves the meeting,
    also when only some of the steps are looked at.

    Attributes:
        range: (pairs,) R [m].
        pairs: (pairs, 2) robot indices.
        nodes: (sub-periods, n) steps looked at.
        names: of all robots.
    """

    range: Array
    pairs: NDArray[np.intp]
    nodes: NDArray[np.intp]
    names: tuple[str, ...]
    name: str = "meeting"
    unit: str = "m"
    tolerance: float = 1e-3
    swarm_axis: int = 0

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (pairs, sub-periods)."""
        found = distances(motion.q, self.pairs, self.nodes)
        R = self.range[:, None]
        value, slope = softmin(found.squares, SHARPNESS * R[..., None] ** 2)

        def pull(weights: Array, cotangent: Cotangent) -> None:
            force = slope * (weights / (2.0 * R))[..., None]
            pull_squares(found, self.pairs, self.nodes, force, cotangent.q)

        return Evaluation((value - R**2) / (2.0 * R), pull)

    def violation(self, motion: Motion) -> Array:
        """How far the closest approach misses the range [m], (pairs, sub-periods)."""
        closest: Array = np.sqrt(distances(motion.q, self.pairs, self.nodes).squares.min(axis=-1))
        return closest - self.range[:, None]

    def place(self, index: tuple[int, ...]) -> Place:
        """The pair, the sub-period (counted from 1)."""
        return pair_and_sub_period(self.names, self.pairs, index)

    def stacked(self, swarms: int, robots: int) -> Meeting:
        """The same for several swarms."""
        pairs = stacked_pairs(self.pairs, swarms, robots)
        return replace(self, pairs=pairs, range=np.tile(self.range, swarms), names=self.names * swarms)

    def of(self, rows: Rows) -> Meeting:
        """The same for some of the pairs."""
        return replace(self, pairs=self.pairs[rows], range=self.range[rows])


def softmin(values: Array, tau: Array) -> tuple[Array, Array]:
    """Boltzmann mean over the last axis, never below the minimum, and its derivative (as values).

    Args:
        values: (..., n).
        tau: temperature in the values' unit, broadcast against them.
    """
    share = np.exp((values.min(axis=-1, keepdims=True) - values) / tau)
    share /= share.sum(axis=-1, keepdims=True)
    mean = (share * values).sum(axis=-1)
    return mean, share * (1.0 - (values - mean[..., None]) / tau)
