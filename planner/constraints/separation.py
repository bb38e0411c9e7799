"""Robots keep apart: |q_i(t) − q_j(t)| ≥ ε_a (IMEC, Eq. 9e), at the steps and between them.

Distances may count less along an axis, which makes the sphere around a robot an ellipsoid: downwash reaches farther
down than aside.
"""

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
        scale: (ν,) by how much distance counts along each axis; None: fully.
        landing: only the last of the fine samples counts, from where a robot descends.
    """

    pairs: NDArray[np.intp]
    distance: Array
    names: tuple[str, ...]
    dt: float
    scale: Array | None = None
    landing: bool = False
    name: str = "separation"
    unit: str = "m"
    tolerance: float = 1e-3

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (P, S) over the fine samples."""
        delta, squares = self._distances(motion)
        epsilon = self.distance[:, None]
        residual = (epsilon**2 - squares) / (2.0 * epsilon)

        def pull(weights: Array, cotangent: Cotangent) -> None:
            p, s = np.nonzero(weights)  # few pairs are close at any time
            force = (delta[:, p, s] * (weights[p, s] / self.distance[p])).T
            if self.scale is not None:
                force *= self.scale
            on_samples = cotangent.q_fine[self._samples]
            np.subtract.at(on_samples, (s, self.pairs[p, 0]), force)
            np.add.at(on_samples, (s, self.pairs[p, 1]), force)

        return Evaluation(residual, pull)

    def violation(self, motion: Motion) -> Array:
        """ε_a − d [m], (P, S)."""
        _, squares = self._distances(motion)
        missing: Array = self.distance[:, None] - np.sqrt(squares)
        return missing

    def place(self, index: tuple[int, ...]) -> Place:
        """The pair, the instant."""
        i, j = self.pairs[index[0]]
        return Place(f"{self.names[i]}-{self.names[j]}", index[1] * self.dt if not self.landing else None)

    def _distances(self, motion: Motion) -> tuple[Array, Array]:
        """Difference vectors (ν, P, S) and their squared lengths (P, S): time last, where NumPy is fast."""
        x = np.ascontiguousarray(motion.q_fine[self._samples].T)  # (ν, N, S)
        if self.scale is not None:
            x = x * self.scale[:, None, None]  # a copy: x may still be a view of the motion
        delta = x[:, self.pairs[:, 0]] - x[:, self.pairs[:, 1]]
        return delta, (delta * delta).sum(axis=0)

    @property
    def _samples(self) -> slice:
        return slice(-1, None) if self.landing else slice(None)
