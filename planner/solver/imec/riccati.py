"""The LQR sub-problem of one iteration (IMEC, Eq. 26), all robots at once.

minimise Σ_t bᵀδu + ½ δxᵀ Q δx + ½ δuᵀ R δu  subject to  δx(t+1) = A δx(t) + B δu(t),  δx(0) = 0

b is the gradient of the cost with respect to the controls through the dynamics (Eq. 25's α and β in one), so the
minimiser is the gradient seen in the metric R + Γ'QΓ, with Γ the linearised map from controls to states.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.dynamics import Linearisation


@dataclass(frozen=True)
class Gains:
    """The backward sweep of the Riccati equation.

    Attributes:
        K: (T, N, m, n) feedback, or N = 1 for robots that are alike. H_inv: (T, N, m, m), (R + B'PB)⁻¹.
        linear: what they belong to.
    """

    K: Array
    H_inv: Array
    linear: Linearisation


def backward(linear: Linearisation, steps: int, Q: Array, R: Array) -> Gains:
    """P(T) = 0; K = H⁻¹ B'PA, P ← Q + A'P(A − BK), for ``steps`` steps; Q (n, n), R (m, m)."""
    A, B = linear.A, linear.B
    robots, (n, m) = A.shape[1], B.shape[2:]
    K, H_inv = np.empty((steps, robots, m, n)), np.empty((steps, robots, m, m))
    P = np.zeros((robots, n, n))
    for t in reversed(range(steps)):
        a, b = A[t % len(A)], B[t % len(B)]
        PB = P @ b
        H_inv[t] = np.linalg.inv(R + _transposed(b) @ PB)
        K[t] = H_inv[t] @ (_transposed(PB) @ a)
        P = Q + _transposed(a) @ (P @ (a - b @ K[t]))
    return Gains(K, H_inv, linear)


def minimiser(gains: Gains, b: Array) -> Array:
    """δu (T, N, m) for the cost's gradient b (T, N, m): one sweep backward, one forward."""
    A, B = gains.linear
    K, H_inv = gains.K, gains.H_inv
    T, robots, n = len(b), b.shape[1], A.shape[-1]
    At, Bt = _transposed(A), _transposed(B)
    right = b[..., None]
    feedforward = np.empty_like(right)
    r = np.zeros((robots, n, 1))
    for t in reversed(range(T)):
        h = right[t] + Bt[t % len(B)] @ r
        feedforward[t] = H_inv[t] @ h
        r = At[t % len(A)] @ r - _transposed(K[t]) @ h
    du = np.empty_like(right)
    x = np.zeros((robots, n, 1))
    for t in range(T):
        du[t] = -feedforward[t] - K[t] @ x
        x = A[t % len(A)] @ x + B[t % len(B)] @ du[t]
    return du[..., 0]


def _transposed(matrices: Array) -> Array:
    return np.swapaxes(matrices, -1, -2)
