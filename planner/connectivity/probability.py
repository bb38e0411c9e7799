"""Connection probability of pairs of robots in sub-periods (IMEC, Eq. 8), direct double sum.

P = n⁻² Σ_{t∈p} Σ_{s∈p} Γ(q_i(t), q_j(s)) with the Gaussian indicator Γ(a, b) = exp(−|a−b|² / (2 R_c²)): all pairs of
times of the sub-period, not only equal times. Worked out as log P, which neither underflows nor stops pulling however
far apart two robots are.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.connectivity.quadrature import Quadrature


class ConnectionValue(NamedTuple):
    """log P (pairs, sub-periods), and ``pull(weights)``: the gradient (T, N, ν) [1/m] of Σ weights · log P."""

    log_P: Array
    pull: Callable[[Array], Array]


def connection_probability(q: Array, R_c: float, pairs: NDArray[np.intp], quadrature: Quadrature) -> Array:
    """P (pairs, sub-periods) for positions q (T, N, ν) [m] and range R_c [m]."""
    P: Array = np.exp(connection_log_probability(q, R_c, pairs, quadrature).log_P)
    return P


def connection_log_probability(
    q: Array, R_c: float, pairs: NDArray[np.intp], quadrature: Quadrature
) -> ConnectionValue:
    """Log P of every pair and sub-period, and its gradient.

    Args:
        q: (T, N, ν) positions [m].
        R_c: communication range [m].
        pairs: (pairs, 2) robot indices.
        quadrature: nodes and weights ω of the sub-periods' time averages.
    """
    omega = quadrature.weights[..., None]  # (sub-periods, n, 1)
    w = np.moveaxis((q[quadrature.nodes] - q[0].mean(axis=0)) / R_c, 2, 0)  # (N, sub-periods, n, ν)
    half = -0.5 * np.einsum("...d,...d->...", w, w)[..., None]
    one = np.ones_like(half)
    left, right = np.concatenate([w, half, one], axis=-1), np.concatenate([w, one, half], axis=-1)
    moments = omega * right[..., :-1]  # (N, sub-periods, n, ν+1): ω w, ω
    i, j = pairs[:, 0], pairs[:, 1]

    gamma = left[i] @ np.swapaxes(right[j], -1, -2)  # (pairs, sub-periods, n, n): −|a−b|²/2R²
    top = gamma.max(axis=(2, 3), keepdims=True)
    gamma -= top
    np.exp(gamma, out=gamma)
    forward = gamma @ moments[j]  # (pairs, sub-periods, n, ν+1)
    total = (omega * forward[..., -1:]).sum(axis=2)[..., 0]  # P / e^top

    def pull(weights: Array) -> Array:
        # d log P / dq_i(t) = −(ω_t / R P) Σ_s ω_s Γ_ts (w_i(t) − w_j(s)), and the mirror image for robot j.
        scale = (-weights / (total * R_c))[..., None, None] * omega
        backward = np.swapaxes(gamma, -1, -2) @ moments[i]
        on_nodes = np.zeros_like(w)
        _gather(on_nodes, i, scale * (forward[..., -1:] * w[i] - forward[..., :-1]))
        _gather(on_nodes, j, scale * (backward[..., -1:] * w[j] - backward[..., :-1]))
        gradient = np.zeros_like(q)
        # Nodes that fill up a row come before the real one, whose value is therefore the one that stays.
        gradient[quadrature.nodes] = np.moveaxis(on_nodes, 0, 2)
        return gradient

    return ConnectionValue(top[..., 0, 0] + np.log(total), pull)


def _gather(per_robot: Array, robots: NDArray[np.intp], per_pair: Array) -> None:
    """Add each pair's part to its robot's."""
    incidence = (np.arange(len(per_robot))[:, None] == robots).astype(np.float64)  # (N, pairs)
    flat = per_pair.reshape(len(robots), -1)
    per_robot += (incidence @ flat).reshape(per_robot.shape)
