"""Policy ``probabilistic``: connection probabilities reach a threshold in every sub-period (IMEC, Eq. 9d)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from missions.indicator import Indicator
from planner.connectivity.all_times import log_probability
from planner.connectivity.quadrature import Quadrature
from planner.constraints.base import Evaluation, Place, stacked_pairs
from planner.constraints.pairwise import Rows, pair_and_sub_period
from planner.dynamics import Cotangent, Motion

THINNED = 2e-3  # of log P that is asked for on top: sums over fewer steps are off by about as much


@dataclass(frozen=True)
class Connection:
    """g = log ε_c − log P, dimensionless; a little more where log P is from fewer steps than count.

    The logarithm pulls from afar: its gradient does not vanish with distance as that of ε_c − P does, so robots find
    each other in workspaces many times R_c wide.

    Attributes:
        R_c: communication range [m]. threshold: (pairs,) ε_c.
        pairs: (pairs, 2) robot indices.
        quadrature: the sub-periods' time averages, thinned: what the search evaluates.
        exact: the same from every step: what counts.
        names: of all robots. indicator: Γ.
        single: searched in single precision, as is enough to choose among searches.
    """

    R_c: float
    threshold: Array
    pairs: NDArray[np.intp]
    quadrature: Quadrature
    exact: Quadrature
    names: tuple[str, ...]
    indicator: Indicator
    name: str = "connection"
    unit: str = ""
    tolerance: float = 2e-3
    single: bool = False
    swarm_axis: int = 0

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (pairs, sub-periods)."""
        value = log_probability(
            motion.q[:-1], self.R_c, self.indicator, self.pairs, self.quadrature, single=self.single
        )

        def pull(weights: Array, cotangent: Cotangent) -> None:
            cotangent.q[:-1] -= value.pull(weights)

        return Evaluation(np.log(self.threshold)[:, None] + self._more - value.log_P, pull)

    @property
    def _more(self) -> float:
        return THINNED if self.quadrature.nodes.size < self.exact.nodes.size else 0.0

    def violation(self, motion: Motion) -> Array:
        """Missing log-probability, (pairs, sub-periods)."""
        value = log_probability(motion.q[:-1], self.R_c, self.indicator, self.pairs, self.exact)
        missing: Array = np.log(self.threshold)[:, None] - value.log_P
        return missing

    def place(self, index: tuple[int, ...]) -> Place:
        """The pair, the sub-period (counted from 1)."""
        return pair_and_sub_period(self.names, self.pairs, index)

    def stacked(self, swarms: int, robots: int) -> Connection:
        """The same for several swarms."""
        pairs = stacked_pairs(self.pairs, swarms, robots)
        return replace(
            self, pairs=pairs, threshold=np.tile(self.threshold, swarms), names=self.names * swarms, single=True
        )

    def of(self, rows: Rows) -> Connection:
        """The same for some of the pairs."""
        return replace(self, pairs=self.pairs[rows], threshold=self.threshold[rows])
