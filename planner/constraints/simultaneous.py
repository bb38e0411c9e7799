"""Policy ``simultaneous``: same-time connection probabilities reach a threshold in every sub-period (IMEC, Eq. 29)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from missions.indicator import Indicator
from planner.connectivity.quadrature import Quadrature
from planner.connectivity.same_time import same_time_log_probability
from planner.constraints.base import Evaluation, Place
from planner.constraints.pairwise import Rows, pair_and_sub_period
from planner.dynamics import Cotangent, Motion


@dataclass(frozen=True)
class Simultaneous:
    """g = log ε_c − log P̃, dimensionless; the logarithm for the reason :class:`Connection` has it.

    Attributes:
        R_c: communication range [m]. threshold: (pairs,) ε_c.
        pairs: (pairs, 2) robot indices.
        quadrature: the sub-periods' time averages from every step: a single sum is cheap.
        names: of all robots. indicator: Γ.
    """

    R_c: float
    threshold: Array
    pairs: NDArray[np.intp]
    quadrature: Quadrature
    names: tuple[str, ...]
    indicator: Indicator
    name: str = "same-time connection"
    unit: str = ""
    tolerance: float = 2e-3

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (pairs, sub-periods)."""
        value = same_time_log_probability(motion.q[:-1], self.R_c, self.indicator, self.pairs, self.quadrature)

        def pull(weights: Array, cotangent: Cotangent) -> None:
            cotangent.q[:-1] -= value.pull(weights)

        return Evaluation(np.log(self.threshold)[:, None] - value.log_P, pull)

    def violation(self, motion: Motion) -> Array:
        """Missing log-probability, (pairs, sub-periods)."""
        return self.evaluate(motion).residual

    def place(self, index: tuple[int, ...]) -> Place:
        """The pair, the sub-period (counted from 1)."""
        return pair_and_sub_period(self.names, self.pairs, index)

    def of(self, rows: Rows) -> Simultaneous:
        """The same for some of the pairs."""
        return replace(self, pairs=self.pairs[rows], threshold=self.threshold[rows])
