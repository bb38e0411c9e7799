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

    softmin is the Boltzmann mean Σ d² e^(−d²/τ) / Σ e^(−d²/τ): never below the minimum, so g ≤ 0 proves the meeting.

    Attributes:
        range: R [m].
        pairs: (P, 2) robot indices. bounds: first step and end (exclusive) of each sub-period.
        names: of all robots. dt: planning step [s].
    """

    range: float
    pairs: NDArray[np.intp]
    bounds: tuple[tuple[int, int], ...]
    names: tuple[str, ...]
    dt: float
    name: str = "meeting"
    unit: str = "m"
    tolerance: float = 1e-3

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (P, sub-periods)."""
        delta = self._delta(motion)  # (T, P, ν)
        squares = np.einsum("tpd,tpd->tp", delta, delta)
        tau = SHARPNESS * self.range**2
        softmin = np.empty((len(self.pairs), len(self.bounds)))
        slope = np.zeros_like(squares)  # d softmin / d squares
        for p, (start, end) in enumerate(self.bounds):
            part = squares[start:end]
            share = np.exp((part.min(axis=0) - part) / tau)
            share /= share.sum(axis=0)
            softmin[:, p] = (share * part).sum(axis=0)
            slope[start:end] = share * (1.0 - (part - softmin[:, p]) / tau)

        def pull(weights: Array, cotangent: Cotangent) -> None:
            for p, (start, end) in enumerate(self.bounds):
                force = delta[start:end] * (slope[start:end] * weights[:, p] / self.range)[..., None]
                for pair, (i, j) in enumerate(self.pairs):
                    cotangent.q[start:end, i] += force[:, pair]
                    cotangent.q[start:end, j] -= force[:, pair]

        return Evaluation((softmin - self.range**2) / (2.0 * self.range), pull)

    def violation(self, motion: Motion) -> Array:
        """How far the closest approach misses the range [m], (P, sub-periods)."""
        distance = np.linalg.norm(self._delta(motion), axis=-1)
        return np.stack([distance[a:b].min(axis=0) for a, b in self.bounds], axis=-1) - self.range

    def place(self, index: tuple[int, ...]) -> Place:
        """The pair, the sub-period (counted from 1)."""
        i, j = self.pairs[index[0]]
        return Place(f"{self.names[i]}-{self.names[j]}, sub-period {index[1] + 1}", None)

    def _delta(self, motion: Motion) -> Array:
        q = motion.q[:-1]
        delta: Array = q[:, self.pairs[:, 0]] - q[:, self.pairs[:, 1]]
        return delta
