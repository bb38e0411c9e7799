"""The plan as a motion in continuous time: what the polynomials are fitted to and measured against."""

from __future__ import annotations

import numpy as np

from missions.arrays import Array
from planner.plan import Plan


def plan_motion(plan: Plan, robot: int, t: Array, derivative: int = 0) -> Array:
    """Position [m] or velocity [m/s] or acceleration [m/s²] of a robot between the plan's samples.

    Cubic Hermite interpolation of positions and velocities: exactly the double integrator's motion under controls
    that are constant over a step, and consistent for any other dynamics.

    Args:
        plan: the plan.
        robot: its index.
        t: (K,) times [s]; outside the plan its ends are extended.
        derivative: 0, 1 or 2.

    Returns:
        (K, ν).
    """
    dt = plan.dt
    k = np.clip(np.floor(t / dt + 1e-9).astype(int), 0, len(plan.t) - 2)
    u = np.clip(t / dt - k, 0.0, 1.0)[:, None]
    q, v = plan.q[:, robot], plan.v[:, robot]
    p0, p1, m0, m1 = q[k], q[k + 1], v[k] * dt, v[k + 1] * dt
    chord = p1 - p0
    c2, c3 = 3 * chord - 2 * m0 - m1, m0 + m1 - 2 * chord
    if derivative == 0:
        return np.asarray(p0 + u * (m0 + u * (c2 + u * c3)))
    if derivative == 1:
        return np.asarray((m0 + u * (2 * c2 + 3 * u * c3)) / dt)
    return np.asarray((2 * c2 + 6 * u * c3) / dt**2)
