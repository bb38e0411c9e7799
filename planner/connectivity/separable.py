"""Connection probabilities through moments: linear in robots and steps where the double sum is quadratic in both.

On an interval, a Gaussian is a short sum of cosines, and cos m(a − b) = cos ma cos mb + sin ma sin mb separates. So

    Γ(a, b) = Σ_k Σ_l A_kl f_k(a_x) f_k(b_x) g_l(a_y) g_l(b_y),      P_ij = Σ_kl A_kl M_i,kl M_j,kl,

where M_i = Σ_t ω_t f(x_i(t)) g(y_i(t))ᵀ is all that is ever needed of robot i in a sub-period. The error is absolute,
about 1e-8, so probabilities below :data:`SMALLEST` are left to the double sum. Only for two axes: in three the moments
are so many that nothing is saved.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array

REACH = 6.1  # in ranges: where the Gaussian, and its spectrum, end: exp(−6.1²/2) = 8e-9
SMALLEST = 1e-4  # below it the relative error of P would exceed 1e-4


class MomentValue(NamedTuple):
    """P (pairs, sub-periods), and ``pull(weights)``: the gradient of Σ weights · P with respect to w."""

    P: Array
    pull: Callable[[Array], Array]


def function_counts(w: Array) -> tuple[int, ...]:
    """Number of frequencies an axis needs for points ``w`` (..., ν) in ranges; twice as many functions."""
    return tuple(math.ceil(REACH * (side + REACH) / (2.0 * math.pi)) + 1 for side in extents(w))


def extents(w: Array) -> list[float]:
    """Sides of the box around points (..., ν): axis by axis, since reductions over all but a short axis are slow."""
    return [float(w[..., d].max()) - float(w[..., d].min()) for d in range(w.shape[-1])]


def moment_probability(w: Array, omega: Array, pairs: NDArray[np.intp]) -> MomentValue:
    """P of pairs from their robots' moments.

    Args:
        w: (N, sub-periods, n, 2) positions at the nodes, in ranges.
        omega: (sub-periods, n) weights of the time average.
        pairs: (pairs, 2) robot indices.
    """
    robots, periods = w.shape[:2]
    low = w.min(axis=(0, 1, 2))
    counts = function_counts(w)
    width = w.max(axis=(0, 1, 2)) - low + REACH  # beyond it the periodic Gaussian repeats
    steps = 2.0 * math.pi / width
    axes = [_functions(steps[d] * (w[..., d] - low[d]), counts[d]) for d in range(2)]  # (F_d, N, sub-periods, n)
    f, g = (axis.transpose(1, 2, 0, 3) for axis in axes)  # (N, sub-periods, F_d, n)
    M = (f * omega[:, None]) @ g.swapaxes(-1, -2)  # (N, sub-periods, F_0, F_1)
    a, b = (_spectrum(steps[d], width[d], counts[d]) for d in range(2))
    AM = (a[:, None] * b) * M
    i, j = pairs[:, 0], pairs[:, 1]
    P = _inner(M.reshape(robots, periods, -1), AM.reshape(robots, periods, -1), i, j)

    def pull(weights: Array) -> Array:
        symmetric = np.zeros((periods, robots, robots))
        np.add.at(symmetric.transpose(1, 2, 0), (i, j), weights)
        symmetric += symmetric.swapaxes(1, 2)
        B = symmetric @ AM.reshape(robots, periods, -1).swapaxes(0, 1)  # (sub-periods, N, F_0 F_1)
        B = B.reshape(periods, robots, *M.shape[2:]).swapaxes(0, 1)
        gradient = np.empty_like(w)
        np.einsum("rpfn,rpfn->rpn", f, _turned(B, steps[0]) @ g, out=gradient[..., 0])
        np.einsum("rpfn,rpfn->rpn", g, _turned(B.swapaxes(-1, -2), steps[1]) @ f, out=gradient[..., 1])
        gradient *= omega[..., None]
        return gradient

    return MomentValue(P, pull)


def _functions(theta: Array, count: int) -> Array:
    """Cos and sin of kθ, k = 0..count−1, interleaved: (2 count,) + θ's shape, by recurrence from one sincos."""
    table = np.empty((count, 2, *theta.shape))
    table[0, 0], table[0, 1] = 1.0, 0.0
    np.cos(theta, out=table[1, 0])
    np.sin(theta, out=table[1, 1])
    twice = 2.0 * table[1, 0]
    for k in range(2, count):
        np.multiply(twice, table[k - 1], out=table[k])
        table[k] -= table[k - 2]
    return table.reshape(2 * count, *theta.shape)


def _spectrum(step: float, width: float, count: int) -> Array:
    """Coefficients of the Gaussian of range 1 in those functions: its Fourier transform (Poisson's sum formula)."""
    k = np.arange(count)
    a = math.sqrt(2.0 * math.pi) / width * np.exp(-0.5 * (k * step) ** 2)
    a[1:] *= 2.0
    return np.repeat(a, 2)


def _turned(B: Array, step: float) -> Array:
    """Coefficients of the derivative of Σ_k B_k f_k: cos kθ came from sin kθ and the other way round, times k."""
    cosine, sine = B[..., 0::2, :], B[..., 1::2, :]
    k = step * np.arange(cosine.shape[-2])[:, None]
    out = np.empty(B.shape)
    out[..., 0::2, :] = k * sine
    out[..., 1::2, :] = -k * cosine
    return out


def _inner(M: Array, AM: Array, i: NDArray[np.intp], j: NDArray[np.intp]) -> Array:
    """P (pairs, sub-periods): inner products of pairs; of all robots at once if most pairs are asked for."""
    if 4 * len(i) > len(M) ** 2:
        gram = M.swapaxes(0, 1) @ AM.transpose(1, 2, 0)  # (sub-periods, N, N)
        return np.ascontiguousarray(gram[:, i, j].T)
    P: Array = np.einsum("mpf,mpf->mp", M[i], AM[j])
    return P
