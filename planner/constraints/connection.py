"""Every pair's connection probability reaches a threshold in every sub-period (IMEC, Eq. 9d)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.connectivity.probability import connection_probability, pull_connection_probability
from planner.constraints.base import Evaluation, Place
from planner.dynamics import Cotangent, Motion


@dataclass(frozen=True)
class Connection:
    """g = log ε_c − log P, dimensionless.

    The logarithm pulls from afar: its gradient does not vanish with distance as that of ε_c − P does, so robots find
    each other in workspaces many times R_c wide.

    Attributes:
        R_c: communication range [m]. threshold: ε_c.
        pairs: (P, 2) robot indices. bounds: first step and end (exclusive) of each sub-period.
        names: of all robots. dt: planning step [s].
    """

    R_c: float
    threshold: float
    pairs: NDArray[np.intp]
    bounds: tuple[tuple[int, int], ...]
    names: tuple[str, ...]
    dt: float
    name: str = "connection"
    unit: str = ""
    tolerance: float = 2e-3

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (P, sub-periods)."""
        q = motion.q[:-1]
        P, gamma = connection_probability(q, self.R_c, self.pairs, self.bounds)
        P = np.maximum(P, np.finfo(np.float64).tiny)  # exp underflows beyond 37 R_c

        def pull(weights: Array, cotangent: Cotangent) -> None:
            cotangent.q[:-1] += pull_connection_probability(q, self.R_c, self.pairs, self.bounds, gamma, -weights / P)

        return Evaluation(np.log(self.threshold / P), pull)

    def violation(self, motion: Motion) -> Array:
        """Missing log-probability, (P, sub-periods)."""
        return self.evaluate(motion).residual

    def place(self, index: tuple[int, ...]) -> Place:
        """The pair, the sub-period (counted from 1)."""
        i, j = self.pairs[index[0]]
        return Place(f"{self.names[i]}-{self.names[j]}, sub-period {index[1] + 1}", None)
