"""Robots keep apart: |q_i(t) − q_j(t)| ≥ ε_a (IMEC, Eq. 9e), at the steps and between them.

Distances may count less along an axis, which makes the sphere around a robot an ellipsoid: downwash reaches farther
down than aside.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.constraints.base import Evaluation, Place, stacked_pairs
from planner.constraints.blocks import BLOCK, box_gaps
from planner.dynamics import Cotangent, Motion

MANY_PAIRS = 100  # from here on, boxes of blocks of samples are compared first


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
    swarm_axis: int = 0

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (P, S) over the fine samples.

        Of pairs that are far apart for a while, a bound stands for the residual; it is far below zero.
        """
        x = self._positions(motion)
        squares = self._squares(x) if len(self.pairs) < MANY_PAIRS else self._near_squares(x)
        epsilon = self.distance[:, None]
        squares *= -0.5 / epsilon
        squares += 0.5 * epsilon

        def pull(weights: Array, cotangent: Cotangent) -> None:
            p, s = np.nonzero(weights)  # few pairs are close at any time
            i, j = self.pairs[p, 0], self.pairs[p, 1]
            force = (x[:, i, s] - x[:, j, s]) * (weights[p, s] / self.distance[p])
            if self.scale is not None:
                force *= self.scale[:, None]
            on_samples = cotangent.q_fine[self._samples]
            _, robots, nu = on_samples.shape
            at_i, at_j = s * robots + i, s * robots + j
            for d in range(nu):
                total = np.bincount(at_j, force[d], on_samples[..., d].size)
                total -= np.bincount(at_i, force[d], on_samples[..., d].size)
                on_samples[..., d] += total.reshape(-1, robots)

        return Evaluation(squares, pull)

    def violation(self, motion: Motion) -> Array:
        """ε_a − d [m], (P, S)."""
        squares = self._squares(self._positions(motion))
        missing: Array = self.distance[:, None] - np.sqrt(squares)
        return missing

    def place(self, index: tuple[int, ...]) -> Place:
        """The pair, the instant."""
        i, j = self.pairs[index[0]]
        return Place(f"{self.names[i]}-{self.names[j]}", index[1] * self.dt if not self.landing else None)

    def stacked(self, swarms: int, robots: int) -> Separation:
        """The same for several swarms."""
        pairs = stacked_pairs(self.pairs, swarms, robots)
        return replace(self, pairs=pairs, distance=np.tile(self.distance, swarms), names=self.names * swarms)

    def _positions(self, motion: Motion) -> Array:
        """(ν, N, S), scaled: time last, where NumPy is fast."""
        x = np.ascontiguousarray(motion.q_fine[self._samples].T)
        return x if self.scale is None else x * self.scale[:, None, None]

    def _squares(self, x: Array) -> Array:
        """Squared distances (P, S)."""
        delta = x[:, self.pairs[:, 0]] - x[:, self.pairs[:, 1]]
        delta *= delta
        squares: Array = delta.sum(axis=0)
        return squares

    def _near_squares(self, x: Array) -> Array:
        """Squared distances (P, S); of pairs that stay farther apart than twice the limit, a lower bound a block."""
        gaps, last = box_gaps(x, self.pairs), x.shape[2] - 1
        squares = np.repeat(gaps, BLOCK, axis=1)[:, : last + 1]
        p, block = np.nonzero(gaps < (2.0 * self.distance[:, None]) ** 2)
        s = np.minimum(block[:, None] * BLOCK + np.arange(BLOCK), last)  # the last block may be short
        i, j, p = self.pairs[p, :1], self.pairs[p, 1:], p[:, None]
        delta = x[:, i, s] - x[:, j, s]
        squares[p, s] = (delta * delta).sum(axis=0)
        return squares

    @property
    def _samples(self) -> slice:
        return slice(-1, None) if self.landing else slice(None)
