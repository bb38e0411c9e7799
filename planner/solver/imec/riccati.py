"""The LQR sub-problem of one iteration (IMEC, Eq. 26), in continuous time, all robots at once.

minimise ∫ αᵀδx + βᵀδu + ½ δxᵀQδx + ½ δuᵀRδu dt  subject to  δẋ = A δx + B δu,  δx(0) = 0

    −Ṗ = PA + AᵀP − PBR⁻¹BᵀP + Q,  −ṙ = Mᵀr + α − PBR⁻¹β,  M = A − BR⁻¹BᵀP,  P(T) = 0, r(T) = 0
    δu = −R⁻¹(BᵀPδx + Bᵀr + β)

integrated by one Runge-Kutta 4 step a planning step, as the authors' code does. P does not depend on α and β: for
linear models it is worked out once. The other two equations are linear, so their Runge-Kutta steps are matrices.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from missions.arrays import Array
from planner.dynamics import Linearisation


class Gains(NamedTuple):
    """What the sub-problem's solution takes from the linearisation.

    Attributes:
        P: (T, N, n, n) solution of the Riccati equation, N = 1 for robots that are alike.
        B: (T or 1, N, n, m). R_inv: (m, m).
        advance: (T, N, n, n) one step of δẋ = M δx. respond: (T, N, n, n) of a constant input over it.
    """

    P: Array
    B: Array
    R_inv: Array
    advance: Array
    respond: Array


def solve_riccati(linear: Linearisation, steps: int, dt: float, Q: Array, R: Array) -> Gains:
    """Gains along a linearised motion.

    Args:
        linear: sensitivities of the motion.
        steps: T.
        dt: step [s].
        Q: (n, n) weight of deviations of the state.
        R: (m, m) weight of deviations of the controls.
    """
    A, B = linear
    R_inv = np.asarray(np.linalg.inv(R), dtype=np.float64)
    BRB = B @ R_inv @ _transposed(B)
    P = np.zeros((steps, *np.broadcast_shapes(A.shape[1:], BRB.shape[1:])))
    now = np.zeros(P.shape[1:])
    for t in reversed(range(steps)):
        now = _backward(now, A[t % len(A)], BRB[t % len(BRB)], Q, dt)
        P[t] = now
    hM = dt * (A - BRB @ P)
    one = np.eye(hM.shape[-1])
    respond = dt * (one + hM @ (one + hM @ (one + hM / 4.0) / 3.0) / 2.0)
    advance = one + hM @ respond / dt
    return Gains(P, B, R_inv, advance, respond)


def _backward(P: Array, A: Array, BRB: Array, Q: Array, dt: float) -> Array:
    """One Runge-Kutta 4 step of the Riccati equation, backwards in time."""

    def slope(P: Array) -> Array:
        PA = P @ A
        rate: Array = PA + _transposed(PA) - P @ BRB @ P + Q
        return rate

    k1 = slope(P)
    k2 = slope(P + 0.5 * dt * k1)
    k3 = slope(P + 0.5 * dt * k2)
    k4 = slope(P + dt * k3)
    return P + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


def minimiser(gains: Gains, alpha: Array, beta: Array) -> Array:
    """δu (T, N, m) for α (T, N, n) and β (T, N, m): one sweep backward, one forward."""
    B, Bt = gains.B, _transposed(gains.B)
    b = beta[..., None]
    drive = _transposed(gains.respond) @ (alpha[..., None] - gains.P @ (B @ (gains.R_inv @ b)))
    back = _transposed(gains.advance)
    r = np.empty_like(drive)
    now = np.zeros(drive.shape[1:])
    for t in reversed(range(len(beta))):
        now = back[t] @ now + drive[t]
        r[t] = now
    feedforward = gains.R_inv @ (Bt @ r + b)
    push = -gains.respond @ (B @ feedforward)
    x = np.empty_like(r)
    now = np.zeros(drive.shape[1:])
    for t in range(len(beta)):
        x[t] = now
        now = gains.advance[t] @ now + push[t]
    du: Array = -feedforward - gains.R_inv @ (Bt @ (gains.P @ x))
    return du[..., 0]


def _transposed(matrices: Array) -> Array:
    return np.swapaxes(matrices, -1, -2)
