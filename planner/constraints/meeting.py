"""Pairs truly meet: within range at the same time at least once in every sub-period."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.constraints.base import Evaluation, Place
from planner.dynamics import Cotangent, Motion

SHARPNESS = 0.1  # τ / R²: smaller follows the closest instant alone, larger blends more instants in


@dataclass(frozen=True)
class Meeting:
    """g = (softmin_t d²(t) − R²)/(2 R), in metres to first order at the limit.

    softmin is the Boltzmann mean Σ d² e^(−d²/τ) / Σ e^(−d²/τ): never below the minimum, so g ≤ 0 proves the meeting,
    also when only some of the steps are looked at.

    Attributes:
        range: R [m].
        pairs: (P, 2) robot indices.
        nodes: (sub-periods, n) steps looked at.
        names: of all robots.
    """

    range: float
    pairs: NDArray[np.intp]
    nodes: NDArray[np.intp]
    names: tuple[str, ...]
    name: str = "meeting"
    unit: str = "m"
    tolerance: float = 1e-3

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (P, sub-periods)."""
        delta = self._delta(motion)  # (ν, P, sub-periods, n)
        squares = (delta * delta).sum(axis=0)
        tau = SHARPNESS * self.range**2
        share = np.exp((squares.min(axis=-1, keepdims=True) - squares) / tau)
        share /= share.sum(axis=-1, keepdims=True)
        softmin = (share * squares).sum(axis=-1)

        def pull(weights: Array, cotangent: Cotangent) -> None:
            slope = share * (1.0 - (squares - softmin[..., None]) / tau)  # d softmin / d squares
            force = delta * (slope * (weights / self.range)[..., None])
            robots = np.arange(motion.q.shape[1])[:, None]
            incidence = (robots == self.pairs[:, 0]).astype(np.float64) - (robots == self.pairs[:, 1])  # (N, P)
            on_nodes = np.tensordot(incidence, force, axes=(1, 1))  # (N, ν, sub-periods, n)
            np.add.at(cotangent.q, self.nodes, on_nodes.transpose(2, 3, 0, 1))

        return Evaluation((softmin - self.range**2) / (2.0 * self.range), pull)

    def violation(self, motion: Motion) -> Array:
        """How far the closest approach misses the range [m], (P, sub-periods)."""
        closest: Array = np.linalg.norm(self._delta(motion), axis=0).min(axis=-1)
        return closest - self.range

    def place(self, index: tuple[int, ...]) -> Place:
        """The pair, the sub-period (counted from 1)."""
        i, j = self.pairs[index[0]]
        return Place(f"{self.names[i]}-{self.names[j]}, sub-period {index[1] + 1}", None)

    def _delta(self, motion: Motion) -> Array:
        x = np.ascontiguousarray(motion.q[self.nodes].transpose(3, 2, 0, 1))  # (ν, N, sub-periods, n)
        delta: Array = x[:, self.pairs[:, 0]] - x[:, self.pairs[:, 1]]
        return delta
