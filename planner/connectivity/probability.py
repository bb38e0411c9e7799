"""Connection probability of pairs of robots in sub-periods (IMEC, Eq. 8), direct double sum.

P = n⁻² Σ_{t∈p} Σ_{s∈p} Γ(q_i(t), q_j(s)) with the Gaussian indicator Γ(a, b) = exp(−|a−b|² / (2 R_c²)): all pairs of
times of the sub-period, not only equal times.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array


class ConnectionValue(NamedTuple):
    """P (pairs, sub-periods), and the indicator tables its gradient is made of (one (pairs, n, n) a sub-period)."""

    P: Array
    gamma: tuple[Array, ...]


def gaussian_indicator(a: Array, b: Array, R_c: float) -> Array:
    """Γ(a_t, b_s) for a (..., n, ν) and b (..., m, ν) [m]: (..., n, m)."""
    scale = 1.0 / (R_c * R_c)
    exponent = np.matmul(a * scale, np.swapaxes(b, -1, -2))
    exponent -= (0.5 * scale) * np.einsum("...td,...td->...t", a, a)[..., :, None]
    exponent -= (0.5 * scale) * np.einsum("...td,...td->...t", b, b)[..., None, :]
    gamma: Array = np.exp(exponent, out=exponent)
    return gamma


def connection_probability(
    q: Array, R_c: float, pairs: NDArray[np.intp], bounds: Sequence[tuple[int, int]]
) -> ConnectionValue:
    """P of every pair and sub-period.

    Args:
        q: (T, N, ν) positions [m].
        R_c: communication range [m].
        pairs: (pairs, 2) robot indices.
        bounds: first step and end (exclusive) of each sub-period.

    Returns:
        P (pairs, sub-periods) and the indicator tables.
    """
    X = np.ascontiguousarray(q.transpose(1, 0, 2))  # (N, T, ν)
    i, j = pairs[:, 0], pairs[:, 1]
    gamma = tuple(gaussian_indicator(X[i, a:b], X[j, a:b], R_c) for a, b in bounds)
    P = np.stack([table.mean(axis=(1, 2)) for table in gamma], axis=-1)
    return ConnectionValue(P, gamma)


def pull_connection_probability(
    q: Array,
    R_c: float,
    pairs: NDArray[np.intp],
    bounds: Sequence[tuple[int, int]],
    gamma: Sequence[Array],
    weights: Array,
) -> Array:
    """Gradient (T, N, ν) [1/m] of Σ weights · P, weights (pairs, sub-periods).

    dP/dq_i(t) = −(n R_c)⁻² Σ_s Γ_ts (q_i(t) − q_j(s)), and the mirror image for robot j.
    """
    gradient = np.zeros_like(q)
    X = np.ascontiguousarray(q.transpose(1, 0, 2))
    i, j = pairs[:, 0], pairs[:, 1]
    for p, (start, end) in enumerate(bounds):
        a, b, table = X[i, start:end], X[j, start:end], gamma[p]
        scale = (-weights[:, p] / ((end - start) * R_c) ** 2)[:, None, None]
        pull_a = (table.sum(axis=2)[..., None] * a - table @ b) * scale  # (pairs, n, ν)
        pull_b = (table.sum(axis=1)[..., None] * b - np.swapaxes(table, 1, 2) @ a) * scale
        for pair in range(len(pairs)):
            gradient[start:end, i[pair]] += pull_a[pair]
            gradient[start:end, j[pair]] += pull_b[pair]
    return gradient
