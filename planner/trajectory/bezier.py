"""Between ascending powers of time and Bézier (Bernstein) control points on one piece.

A polynomial of degree n on [0, T] is p(t) = Σ_k c_k t^k = Σ_i b_i B_i^n(t/T); the control points b bound it:
min b <= p <= max b on the piece (convex hull property).
"""

from __future__ import annotations

import functools
import math

import numpy as np

from missions.arrays import Array, frozen


@functools.cache
def to_points_matrix(degree: int) -> Array:
    """(n+1, n+1) matrix P with b = P (c_k T^k): b_i = Σ_{k<=i} C(i,k) / C(n,k) c_k T^k."""
    n = degree
    return frozen([[math.comb(i, k) / math.comb(n, k) for k in range(n + 1)] for i in range(n + 1)])


@functools.cache
def to_powers_matrix(degree: int) -> Array:
    """(n+1, n+1) inverse: c_k T^k = C(n,k) Δ^k b_0 = C(n,k) Σ_{i<=k} (-1)^(k-i) C(k,i) b_i."""
    n = degree
    return frozen([[math.comb(n, k) * (-1) ** (k - i) * math.comb(k, i) for i in range(n + 1)] for k in range(n + 1)])


def control_points(coefficients: Array, durations: Array) -> Array:
    """Control points (M, ..., n+1) of pieces.

    Args:
        coefficients: (M, ..., n+1) ascending powers of the time since the piece's start.
        durations: (M,) [s].
    """
    n = coefficients.shape[-1] - 1
    powers = durations[:, None] ** np.arange(n + 1)  # T^k
    shape = (len(durations),) + (1,) * (coefficients.ndim - 2) + (n + 1,)
    points: Array = (coefficients * powers.reshape(shape)) @ to_points_matrix(n).T
    return points


def power_coefficients(points: Array, durations: Array) -> Array:
    """Inverse of :func:`control_points`."""
    n = points.shape[-1] - 1
    powers = durations[:, None] ** np.arange(n + 1)
    shape = (len(durations),) + (1,) * (points.ndim - 2) + (n + 1,)
    coefficients: Array = (points @ to_powers_matrix(n).T) / powers.reshape(shape)
    return coefficients
