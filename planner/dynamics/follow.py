"""Controls with which a model flies what a point mass does: where a search in a dear model begins.

Least squares in position and velocity by differential dynamic programming: a Riccati sweep along the motion so far, and
a rollout that the gains keep on course, with controls clipped to their bounds (Jacobson and Mayne 1970; Li and Todorov
2004, iLQR). A few sweeps take what a few dozen evaluations of a search do.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from missions.arrays import Array
from planner.dynamics.base import Motion
from planner.dynamics.casadi_model import CasadiDynamics

SWEEPS = 4
PACE = 0.5  # [s] by which a velocity counts beside a position
EFFORT = 1e-3  # of a control's deviation from the middle of its range, in half ranges, beside metres
SHARES = (1.0, 0.5, 0.2, 0.05)  # of a sweep's feed-forward that are tried
ENOUGH = 1e-3  # relative fall of the cost below which another sweep is not worth it


class _Gains(NamedTuple):
    """u − u_before = forward + back (x − x_before): (T, N, m) and (T, N, m, n)."""

    forward: Array
    back: Array


def controls_along(dynamics: CasadiDynamics, target: Motion) -> Array:
    """Controls (T, N, m) whose motion is near ``target``, which has the same steps; clipped to their bounds.

    How near they come is for the caller to see: not every model flies everything.
    """
    origin, _ = dynamics.control_scale
    u = np.broadcast_to(origin, dynamics.controls_shape).copy()
    x = dynamics.at_steps(u)
    cost = _cost(dynamics, target, x, u)
    for _ in range(SWEEPS):
        gains, before = _sweep(dynamics, target, x, u), cost
        for share in SHARES:
            x_tried, u_tried = _rolled(dynamics, x, u, gains, share)
            tried = _cost(dynamics, target, x_tried, u_tried)
            if tried < cost:
                x, u, cost = x_tried, u_tried, tried
                break
        if cost > (1.0 - ENOUGH) * before:
            break
    return u


def _cost(dynamics: CasadiDynamics, target: Motion, x: Array, u: Array) -> float:
    """½ Σ |q − q*|² + PACE² |v − v*|² + EFFORT |u|²."""
    origin, unit = dynamics.control_scale
    q, v = dynamics.outputs(x, u)
    parts = (q - target.q, PACE * (v - target.v), EFFORT**0.5 * (u - origin) / unit)
    return 0.5 * sum(float(np.vdot(part, part)) for part in parts)


def _sweep(dynamics: CasadiDynamics, target: Motion, x: Array, u: Array) -> _Gains:
    """Riccati's recursion along a motion."""
    (T, N, m), n, nu = dynamics.controls_shape, x.shape[2], target.q.shape[2]
    origin, unit = dynamics.control_scale
    onwards, B = dynamics.sensitivities(u)
    q, v = dynamics.outputs(x, u)
    C = dynamics.output_slopes(x, u) * np.repeat([1.0, PACE], nu)[:, None]
    error = np.concatenate([q - target.q, PACE * (v - target.v)], axis=2)[..., None]
    r, R = (EFFORT * (u - origin) / unit**2)[..., None], np.diag(EFFORT / unit**2)
    gains = _Gains(np.empty((T, N, m)), np.empty((T, N, m, n)))
    S, s = _t(C[-1]) @ C[-1], _t(C[-1]) @ error[-1]
    for t in reversed(range(T)):
        SB = S @ B[t]
        H = np.linalg.inv(R + _t(B[t]) @ SB)
        forward, back = -H @ (r[t] + _t(B[t]) @ s), -H @ (_t(SB) @ onwards[t])
        gains.forward[t], gains.back[t] = forward[..., 0], back
        s = _t(C[t]) @ error[t] + _t(onwards[t]) @ (s + SB @ forward)
        closed = onwards[t] + B[t] @ back  # Joseph's form: S stays symmetric and positive
        S = _t(C[t]) @ C[t] + _t(back) @ R @ back + _t(closed) @ S @ closed
    return gains


def _rolled(dynamics: CasadiDynamics, x: Array, u: Array, gains: _Gains, share: float) -> tuple[Array, Array]:
    """States and controls with gains in force."""
    x_new, u_new = np.empty_like(x), np.empty_like(u)
    x_new[0] = x[0]
    for t in range(len(u)):
        correction = (gains.back[t] @ (x_new[t] - x[t])[..., None])[..., 0]
        u_new[t] = np.clip(u[t] + share * gains.forward[t] + correction, dynamics.lower, dynamics.upper)
        x_new[t + 1] = dynamics.advance(x_new[t], u_new[t])
    return x_new, u_new


def _t(M: Array) -> Array:
    return np.swapaxes(M, -1, -2)
