"""Starts in motion and ends that are given, exact for every value of the variables.

Controls become affine in the variables: u = S P(z) + u_0. The offset u_0 begins with the accelerations that are given
and brings robots that start in motion to rest, since modes begin at zero and leave the final velocity as it is. P
projects the variables of a robot whose end is given onto those that lead there: with the linear map w from a control
to the displacement at the end, and c = Sᵀ w,

    P(z) = z − c (c·z − d)/(c·c),   d = end − (end of the motion under u_0).

So what is given is no constraint of the search: no penalty, no tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.dynamics import Cotangent, DoubleIntegrator
from planner.errors import PlannerError
from planner.problem import Problem
from planner.solver.modes import ControlModes

BRAKING = 0.125  # share of the horizon in which u_0 brings a moving start to rest
FADING = 1.0  # [s] in which a given acceleration is gone


@dataclass(frozen=True)
class EndedModes(ControlModes):
    """Modes whose controls meet the given starts and ends.

    Attributes:
        offset: (T, N, ν) u_0 [m/s²].
        fixed: indices of the robots whose end is given.
        c: (K,) displacement at the end per unit of z [m].
        target: (len(fixed), ν) d [m].
    """

    offset: Array
    fixed: NDArray[np.intp]
    c: Array
    target: Array

    def controls(self, z: Array) -> Array:
        """Controls (T, N, ν) of variables z (K, N, ν)."""
        along = np.tensordot(self.c, z[:, self.fixed], axes=1) - self.target
        z = z.copy()
        z[:, self.fixed] -= self.c[:, None, None] * (along / (self.c @ self.c))
        return super().controls(z) + self.offset

    def pull(self, to_u: Array) -> Array:
        """Gradient with respect to z of a gradient with respect to u."""
        to_z = super().pull(to_u)
        along = np.tensordot(self.c, to_z[:, self.fixed], axes=1)
        to_z[:, self.fixed] -= self.c[:, None, None] * (along / (self.c @ self.c))
        return to_z

    def variables(self, u: Array) -> Array:
        """The z whose controls are nearest to u (least squares)."""
        return super().variables(u - self.offset)


def with_ends(modes: ControlModes, problem: Problem) -> ControlModes:
    """Modes for a problem's starts and ends: the same if it gives neither velocities nor ends.

    Raises:
        PlannerError: the problem's dynamics are not the double integrator's.
    """
    dynamics = problem.dynamics
    moving = isinstance(dynamics, DoubleIntegrator) and (
        dynamics.velocity is not None or dynamics.acceleration is not None
    )
    if problem.ends is None and not moving:
        return modes
    if not isinstance(dynamics, DoubleIntegrator):
        raise PlannerError(
            f"ends that are given and starts in motion need double-integrator dynamics; got {type(dynamics).__name__}"
        )
    ends = np.full(dynamics.start.shape, np.nan) if problem.ends is None else problem.ends
    offset = _brake(dynamics)
    coasted = dynamics.rollout(offset)
    fixed = np.flatnonzero(np.isfinite(ends).all(axis=1))
    to_end = Cotangent.zeros_like(coasted)
    to_end.q[-1] = 1.0
    w = dynamics.pull(coasted, to_end)[:, 0, 0]  # the same for every robot and axis
    return EndedModes(modes.S, offset, fixed, modes.S.T @ w, ends[fixed] - coasted.q[-1, fixed])


def _brake(dynamics: DoubleIntegrator) -> Array:
    """(T, N, ν) accelerations that end every start's motion, smooth from what is given, or zero, to zero."""
    steps, dt = dynamics.steps, dynamics.dt
    offset, velocity = np.zeros(dynamics.controls_shape), dynamics.velocity
    if dynamics.acceleration is not None:
        fading = min(steps, max(2, round(FADING / dt)))
        fade = np.zeros(steps)
        fade[:fading] = np.cos(0.5 * np.pi * (np.arange(fading) + 0.5) / fading) ** 2
        offset += fade[:, None, None] * dynamics.acceleration
        velocity = (0.0 if velocity is None else velocity) + fade.sum() * dt * dynamics.acceleration
    if velocity is None:
        return offset
    braking = max(2, round(BRAKING * steps))
    profile = np.zeros(steps)
    profile[:braking] = np.sin(np.pi * (np.arange(braking) + 0.5) / braking) ** 2
    profile /= profile.sum() * dt
    return np.asarray(offset - profile[:, None, None] * velocity)
