"""The same-time variant of the connection probability (IMEC, Eq. 29): P̃ = n⁻¹ Σ_t Γ(q_i(t), q_j(t)).

With a step for Γ it is the share of the time a pair is in contact. Worked out as log P̃, like log P.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from missions.indicator import Indicator
from planner.connectivity.distances import distances, pull_squares
from planner.connectivity.probability import ConnectionValue
from planner.connectivity.quadrature import Quadrature


def same_time_log_probability(
    q: Array, R_c: float, indicator: Indicator, pairs: NDArray[np.intp], quadrature: Quadrature
) -> ConnectionValue:
    """Log P̃ of every pair and sub-period, and its gradient.

    Args:
        q: (T, N, ν) positions [m].
        R_c: communication range [m].
        indicator: Γ.
        pairs: (pairs, 2) robot indices.
        quadrature: nodes and weights of the sub-periods' time averages.
    """
    found = distances(q, pairs, quadrature.nodes)
    gamma = indicator.log(found.squares / R_c**2)
    top = gamma.value.max(axis=-1, keepdims=True)
    share = quadrature.weights * np.exp(gamma.value - top)
    total = share.sum(axis=-1)

    def pull(weights: Array) -> Array:
        gradient = np.zeros_like(q)
        slope = share * gamma.slope * (weights / (total * R_c**2))[..., None]
        pull_squares(found, pairs, quadrature.nodes, slope, gradient)
        return gradient

    return ConnectionValue(top[..., 0] + np.log(total), pull)
