"""Points whose velocity is the control."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array, frozen
from planner.dynamics.base import Cotangent, Linearisation, Motion, StateGradient


@dataclass(frozen=True)
class SingleIntegrator:
    """q' = q + u dt, exact for velocities u that are constant over a step.

    Velocities jump from step to step, which no polynomial with bounded acceleration follows: for studies, not to fly.

    Attributes:
        start: (N, ν) positions at t = 0 [m].
        steps: T. dt: step [s].
        substeps: s, positions a step that :attr:`Motion.q_fine` holds.
    """

    start: Array
    steps: int
    dt: float
    substeps: int = 2

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", frozen(self.start))

    @property
    def controls_shape(self) -> tuple[int, int, int]:
        """(T, N, ν)."""
        robots, nu = self.start.shape
        return self.steps, robots, nu

    @property
    def rests(self) -> bool:
        """Velocities begin and end as they like."""
        return False

    @property
    def control_scale(self) -> tuple[Array, Array]:
        """About zero, in SI units."""
        nu = self.start.shape[1]
        return np.zeros(nu), np.ones(nu)

    def rollout(self, u: Array) -> Motion:
        """Motion under velocities u (T, N, ν) [m/s]; at the last step the velocity of the step before it counts."""
        T, dt, s = self.steps, self.dt, self.substeps
        q = np.empty((T + 1, *u.shape[1:]))
        q[0] = self.start
        np.cumsum(u * dt, axis=0, out=q[1:])
        q[1:] += self.start
        q_fine = np.empty((s * T + 1, *u.shape[1:]))
        q_fine[::s] = q
        for j in range(1, s):
            q_fine[j::s] = q[:-1] + u * (j * dt / s)
        return Motion(q, np.concatenate([u, u[-1:]]), u, q_fine)

    def pull(self, motion: Motion, cotangent: Cotangent) -> Array:
        """Gradient (T, N, ν) with respect to u; the map is linear, so ``motion`` is not needed."""
        del motion  # Unused.
        dt, s = self.dt, self.substeps
        to_q = cotangent.q + cotangent.q_fine[::s]
        to_u = cotangent.u + cotangent.v[:-1]
        to_u[-1] += cotangent.v[-1]
        for j in range(1, s):
            part = cotangent.q_fine[j::s]
            to_q[:-1] += part
            to_u += part * (j * dt / s)
        to_u += np.cumsum(to_q[:0:-1], axis=0)[::-1] * dt
        return to_u

    def linearise(self, motion: Motion) -> Linearisation:
        """State q: A = 0, B = 1: the model is linear."""
        del motion  # Unused.
        one = np.eye(self.start.shape[1])[None, None]
        return Linearisation(0.0 * one, one)

    def state_gradient(self, motion: Motion, cotangent: Cotangent) -> StateGradient:
        """By q and u."""
        del motion  # Unused.
        return StateGradient(cotangent.q[:-1], cotangent.u + cotangent.v[:-1])
