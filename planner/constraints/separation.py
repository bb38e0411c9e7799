"""Robots keep apart: |q_i(t) − q_j(t)| ≥ ε_a (IMEC, Eq. 9e), at the steps and between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.constraints.base import Evaluation, Place
from planner.dynamics import Cotangent, Motion


@dataclass(frozen=True)
class Separation:
    """g = (ε² − d²)/(2 ε): metres to first order at the limit, smooth even where two robots coincide.

    Attributes:
        pairs: (P, 2) robot indices.
        distance: (P,) smallest distance allowed [m].
        names: of all robots. dt: time between fine samples [s].
    """

    pairs: NDArray[np.intp]
    distance: Array
    names: tuple[str, ...]
    dt: float
    name: str = "separation"
    unit: str = "m"
    tolerance: float = 1e-3

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (S, P) over the fine samples."""
        delta = self._delta(motion)
        residual = (self.distance**2 - _squared(delta)) / (2.0 * self.distance)

        def pull(weights: Array, cotangent: Cotangent) -> None:
            s, p = np.nonzero(weights)  # few pairs are close at any time
            force = delta[s, p] * (weights[s, p] / self.distance[p])[:, None]
            np.subtract.at(cotangent.q_fine, (s, self.pairs[p, 0]), force)
            np.add.at(cotangent.q_fine, (s, self.pairs[p, 1]), force)

        return Evaluation(residual, pull)

    def violation(self, motion: Motion) -> Array:
        """ε_a − d [m], (S, P)."""
        return self.distance - np.sqrt(_squared(self._delta(motion)))

    def place(self, index: tuple[int, ...]) -> Place:
        """The pair, the instant."""
        i, j = self.pairs[index[1]]
        return Place(f"{self.names[i]}-{self.names[j]}", index[0] * self.dt)

    def _delta(self, motion: Motion) -> Array:
        q = motion.q_fine
        delta: Array = q[:, self.pairs[:, 0]] - q[:, self.pairs[:, 1]]
        return delta


def _squared(delta: Array) -> Array:
    """|delta|² over the last axis."""
    squares: Array = np.einsum("...d,...d->...", delta, delta)
    return squares
