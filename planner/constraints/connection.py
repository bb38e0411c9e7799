"""Every pair's connection probability reaches a threshold in every sub-period (IMEC, Eq. 9d)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.connectivity.probability import connection_log_probability
from planner.connectivity.quadrature import Quadrature
from planner.constraints.base import Evaluation, Place
from planner.dynamics import Cotangent, Motion


@dataclass(frozen=True)
class Connection:
    """g = log ε_c − log P, dimensionless.

    The logarithm pulls from afar: its gradient does not vanish with distance as that of ε_c − P does, so robots find
    each other in workspaces many times R_c wide.

    Attributes:
        R_c: communication range [m]. threshold: ε_c.
        pairs: (P, 2) robot indices.
        quadrature: the sub-periods' time averages, thinned: what the search evaluates.
        exact: the same from every step: what counts.
        names: of all robots.
    """

    R_c: float
    threshold: float
    pairs: NDArray[np.intp]
    quadrature: Quadrature
    exact: Quadrature
    names: tuple[str, ...]
    name: str = "connection"
    unit: str = ""
    tolerance: float = 2e-3

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (P, sub-periods)."""
        value = connection_log_probability(motion.q[:-1], self.R_c, self.pairs, self.quadrature)

        def pull(weights: Array, cotangent: Cotangent) -> None:
            cotangent.q[:-1] -= value.pull(weights)

        return Evaluation(np.log(self.threshold) - value.log_P, pull)

    def violation(self, motion: Motion) -> Array:
        """Missing log-probability, (P, sub-periods)."""
        value = connection_log_probability(motion.q[:-1], self.R_c, self.pairs, self.exact)
        missing: Array = np.log(self.threshold) - value.log_P
        return missing

    def place(self, index: tuple[int, ...]) -> Place:
        """The pair, the sub-period (counted from 1)."""
        i, j = self.pairs[index[0]]
        return Place(f"{self.names[i]}-{self.names[j]}, sub-period {index[1] + 1}", None)
