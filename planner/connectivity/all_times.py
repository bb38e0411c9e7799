"""The connection probability (IMEC, Eq. 8) with either indicator.

The Gaussian's double sum has kernels of its own (:mod:`planner.connectivity.probability`); a Gaussian of steepness
r_Γ is one of range R_c/√r_Γ. The sigmoid's is summed here as it stands.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from missions.indicator import Indicator
from planner.connectivity.probability import ConnectionValue, connection_log_probability
from planner.connectivity.quadrature import Quadrature


def log_probability(
    q: Array,
    R_c: float,
    indicator: Indicator,
    pairs: NDArray[np.intp],
    quadrature: Quadrature,
    *,
    exact: bool = False,
    single: bool = False,
) -> ConnectionValue:
    """Log P of every pair and sub-period, and its gradient.

    Args:
        q: (T, N, ν) positions [m].
        R_c: communication range [m].
        indicator: Γ.
        pairs: (pairs, 2) robot indices.
        quadrature: nodes and weights of the sub-periods' time averages.
        exact: never by an approximation, whose relative error is up to 1e-4.
        single: Gaussians in single precision.
    """
    if indicator.shape == "gaussian":
        R = R_c / math.sqrt(indicator.steepness)
        return connection_log_probability(q, R, pairs, quadrature, exact=exact, single=single)
    return _double_sum(q, R_c, indicator, pairs, quadrature)


def _double_sum(
    q: Array, R_c: float, indicator: Indicator, pairs: NDArray[np.intp], quadrature: Quadrature
) -> ConnectionValue:
    w = np.moveaxis((q[quadrature.nodes] - q[0].mean(axis=0)) / R_c, 2, 0)  # (N, sub-periods, n, ν)
    a, b = w[pairs[:, 0]], w[pairs[:, 1]]
    squares = (a * a).sum(axis=-1)[..., :, None] + (b * b).sum(axis=-1)[..., None, :] - 2.0 * a @ np.swapaxes(b, -1, -2)
    gamma = indicator.log(np.maximum(squares, 0.0))  # (pairs, sub-periods, n, n)
    top = gamma.value.max(axis=(2, 3), keepdims=True)
    omega = quadrature.weights
    share = omega[..., :, None] * omega[..., None, :] * np.exp(gamma.value - top)
    total = share.sum(axis=(2, 3))

    def pull(weights: Array) -> Array:
        slope = share * gamma.slope * (2.0 * weights / (total * R_c))[..., None, None]
        on_nodes = np.zeros_like(w)
        np.add.at(on_nodes, pairs[:, 0], slope.sum(axis=3)[..., None] * a - slope @ b)
        np.add.at(on_nodes, pairs[:, 1], slope.sum(axis=2)[..., None] * b - np.swapaxes(slope, -1, -2) @ a)
        gradient = np.zeros_like(q)
        # Nodes that fill up a row come before the real one, whose value is therefore the one that stays.
        gradient[quadrature.nodes] = np.moveaxis(on_nodes, 0, 2)
        return gradient

    return ConnectionValue(top[..., 0, 0] + np.log(total), pull)
