"""Connection probability of pairs of robots in sub-periods (IMEC, Eq. 8).

P = n⁻² Σ_{t∈p} Σ_{s∈p} Γ(q_i(t), q_j(s)) with the Gaussian indicator Γ(a, b) = exp(−|a−b|² / (2 R_c²)): all pairs of
times of the sub-period, not only equal times. Worked out as log P, which neither underflows nor stops pulling however
far apart two robots are. By the direct double sum, or, where that is cheaper, through moments (``separable.py``).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.connectivity.quadrature import Quadrature
from planner.connectivity.separable import SMALLEST, extents, function_counts, moment_probability

UNDERFLOW = 1e-250  # sums below it are worked out again, relative to their largest term
SINGLE_UNDERFLOW = 1e-30  # the same in single precision
# [ns], measured: a pair of nodes; a node and moment; a node and function; whatever the size.
DIRECT_COST, MOMENT_COST, FUNCTION_COST, FIXED_COST = 9.0, 0.8, 15.0, 2e5


class ConnectionValue(NamedTuple):
    """log P (pairs, sub-periods), and ``pull(weights)``: the gradient (T, N, ν) [1/m] of Σ weights · log P."""

    log_P: Array
    pull: Callable[[Array], Array]


def connection_probability(q: Array, R_c: float, pairs: NDArray[np.intp], quadrature: Quadrature) -> Array:
    """P (pairs, sub-periods) for positions q (T, N, ν) [m] and range R_c [m]."""
    P: Array = np.exp(connection_log_probability(q, R_c, pairs, quadrature, exact=True).log_P)
    return P


def connection_log_probability(
    q: Array, R_c: float, pairs: NDArray[np.intp], quadrature: Quadrature, *, exact: bool = False, single: bool = False
) -> ConnectionValue:
    """Log P of every pair and sub-period, and its gradient.

    Args:
        q: (T, N, ν) positions [m].
        R_c: communication range [m].
        pairs: (pairs, 2) robot indices.
        quadrature: nodes and weights ω of the sub-periods' time averages.
        exact: never through moments, whose relative error is up to 1e-4.
        single: the double sum in single precision, whose relative error is about 1e-5.
    """
    w = np.ascontiguousarray(np.moveaxis((q[quadrature.nodes] - q[0].mean(axis=0)) / R_c, 2, 0))
    through_moments = not exact and cheaper_through_moments(w, len(pairs))
    if through_moments:
        value = _mixed(w, quadrature.weights, pairs)
    elif single:
        value = _direct(w.astype(np.float32), quadrature.weights.astype(np.float32), pairs)
    else:
        value = _direct(w, quadrature.weights, pairs)

    def pull(weights: Array) -> Array:
        gradient = np.zeros_like(q)
        # Nodes that fill up a row come before the real one, whose value is therefore the one that stays.
        gradient[quadrature.nodes] = np.moveaxis(value.pull(weights) / R_c, 0, 2)
        return gradient

    return ConnectionValue(value.log_P, pull)


def cheaper_through_moments(w: Array, pairs: int) -> bool:
    """Whether moments cost less than the double sum, for nodes w (N, sub-periods, n, ν) in ranges."""
    robots, periods, nodes, nu = w.shape
    if nu != 2:
        return False
    functions = [2 * count for count in function_counts(w)]
    moments = MOMENT_COST * math.prod(functions) + FUNCTION_COST * sum(functions)
    through_moments = FIXED_COST + robots * periods * nodes * moments
    return bool(through_moments < DIRECT_COST * pairs * periods * nodes * nodes)


def _mixed(w: Array, omega: Array, pairs: NDArray[np.intp]) -> ConnectionValue:
    """Through moments; pairs too far apart for their absolute error by the double sum. Gradient with respect to w."""
    moments = moment_probability(w, omega, pairs)
    near = moments.P > SMALLEST
    log_P = np.log(np.where(near, moments.P, 1.0))
    far = np.flatnonzero(~near.all(axis=1))
    if len(far) == 0:
        return ConnectionValue(log_P, lambda weights: moments.pull(weights / moments.P))
    direct = _direct(w, omega, pairs[far])
    log_P[far] = np.where(near[far], log_P[far], direct.log_P)

    def pull(weights: Array) -> Array:
        gradient = moments.pull(np.where(near, weights / np.where(near, moments.P, 1.0), 0.0))
        gradient += direct.pull(np.where(near[far], 0.0, weights[far]))
        return gradient

    return ConnectionValue(log_P, pull)


def _direct(w: Array, omega: Array, pairs: NDArray[np.intp]) -> ConnectionValue:
    """Log P by the double sum, for nodes w (N, sub-periods, n, ν) in ranges. Gradient with respect to w."""
    column = omega[..., None]  # (sub-periods, n, 1)
    half = -0.5 * np.einsum("...d,...d->...", w, w)[..., None]
    one = np.ones_like(half)
    left, right = np.concatenate([w, half, one], axis=-1), np.concatenate([w, one, half], axis=-1)
    moments = column * right[..., :-1]  # (N, sub-periods, n, ν+1): ω w, ω
    right = np.ascontiguousarray(np.swapaxes(right, -1, -2))  # BLAS is slow with small matrices that are not
    i, j = pairs[:, 0], pairs[:, 1]

    gamma = left[i] @ right[j]  # (pairs, sub-periods, n, n): −|a−b|²/2
    top = gamma.max(axis=(2, 3)) if _may_underflow(w) else None
    if top is not None:
        gamma -= top[..., None, None]
    np.exp(gamma, out=gamma)
    on_j = (gamma @ column)[..., 0]  # (pairs, sub-periods, n): Σ_s ω_s Γ_ts
    total = np.einsum("pn,mpn->mp", omega, on_j)  # P, relative to the largest Γ if that may underflow
    log_P = np.log(total) if top is None else top + np.log(total)

    def pull(weights: Array) -> Array:
        # d log P / dw_i(t) = −(ω_t / P) Σ_s ω_s Γ_ts (w_i(t) − w_j(s)), and the mirror image for robot j.
        gradient = np.zeros_like(w)
        used = np.flatnonzero(weights.any(axis=1))
        if len(used) == 0:
            return gradient
        some, i, j = (gamma if len(used) == len(gamma) else gamma[used]), pairs[used, 0], pairs[used, 1]
        scale = (-weights[used] / total[used]).astype(w.dtype)[..., None, None] * column
        forward = some @ moments[j]  # (pairs, sub-periods, n, ν+1)
        backward = np.swapaxes(some, -1, -2) @ moments[i]
        _gather(gradient, i, scale * (forward[..., -1:] * w[i] - forward[..., :-1]))
        _gather(gradient, j, scale * (backward[..., -1:] * w[j] - backward[..., :-1]))
        return gradient

    return ConnectionValue(log_P, pull)


def _may_underflow(w: Array) -> bool:
    """Whether two nodes may be so far apart that every Γ of a pair vanishes."""
    smallest = UNDERFLOW if w.dtype == np.float64 else SINGLE_UNDERFLOW
    return 0.5 * sum(side * side for side in extents(w)) > -math.log(smallest)


def _gather(per_robot: Array, robots: NDArray[np.intp], per_pair: Array) -> None:
    """Add each pair's part to its robot's."""
    incidence = (np.arange(len(per_robot))[:, None] == robots).astype(per_pair.dtype)  # (N, pairs)
    flat = per_pair.reshape(len(robots), -1)
    per_robot += (incidence @ flat).reshape(per_robot.shape)
