"""Point masses whose acceleration is the control."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array, frozen
from planner.dynamics.base import Cotangent, Linearisation, Motion, StateGradient


@dataclass(frozen=True)
class DoubleIntegrator:
    """Point masses with bounded acceleration, exact for controls that are constant over a step.

    v' = v + u dt, q' = q + v dt + ½ u dt².

    Attributes:
        start: (N, ν) positions at t = 0 [m].
        steps: T. dt: step [s].
        substeps: m, positions a step that :attr:`Motion.q_fine` holds.
        velocity: (N, ν) velocities at t = 0 [m/s]; None: at rest.
        acceleration: (N, ν) what searches have controls begin with [m/s²]; None: zero. Rollouts are not concerned.
    """

    start: Array
    steps: int
    dt: float
    substeps: int = 2
    velocity: Array | None = None
    acceleration: Array | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", frozen(self.start))
        for name in ("velocity", "acceleration"):
            if (value := getattr(self, name)) is not None:
                object.__setattr__(self, name, frozen(value))

    @property
    def controls_shape(self) -> tuple[int, int, int]:
        """(T, N, ν)."""
        robots, nu = self.start.shape
        return self.steps, robots, nu

    @property
    def rests(self) -> bool:
        """From rest to rest."""
        return True

    @property
    def control_scale(self) -> tuple[Array, Array]:
        """About zero, in SI units."""
        nu = self.start.shape[1]
        return np.zeros(nu), np.ones(nu)

    def rollout(self, u: Array) -> Motion:
        """Motion under accelerations u (T, N, ν) [m/s²]."""
        T, dt, m = self.steps, self.dt, self.substeps
        v = np.zeros((T + 1, *u.shape[1:]))
        np.cumsum(u * dt, axis=0, out=v[1:])
        if self.velocity is not None:
            v += self.velocity
        q = np.empty_like(v)
        q[0] = self.start
        np.cumsum(v[:-1] * dt + u * (0.5 * dt**2), axis=0, out=q[1:])
        q[1:] += self.start
        q_fine = np.empty((m * T + 1, *u.shape[1:]))
        q_fine[::m] = q
        for j in range(1, m):
            tau = j * dt / m
            q_fine[j::m] = q[:-1] + v[:-1] * tau + u * (0.5 * tau**2)
        return Motion(q, v, u, q_fine)

    def pull(self, motion: Motion, cotangent: Cotangent) -> Array:
        """Gradient (T, N, ν) with respect to u; the map is linear, so ``motion`` is not needed."""
        del motion  # Unused.
        dt, m = self.dt, self.substeps
        to_q = cotangent.q + cotangent.q_fine[::m]
        to_v = cotangent.v.copy()
        to_u = cotangent.u.copy()
        for j in range(1, m):
            tau = j * dt / m
            part = cotangent.q_fine[j::m]
            to_q[:-1] += part
            to_v[:-1] += part * tau
            to_u += part * (0.5 * tau**2)
        after_q = np.cumsum(to_q[:0:-1], axis=0)[::-1]  # (T, N, ν): sum over the steps after t
        to_v[:-1] += after_q * dt
        to_u += after_q * (0.5 * dt**2)
        to_u += np.cumsum(to_v[:0:-1], axis=0)[::-1] * dt
        return to_u

    def linearise(self, motion: Motion) -> Linearisation:
        """State (q, v): A = [[0, 1], [0, 0]], B = [0, 1]: the model is linear."""
        del motion  # Unused.
        one = np.eye(self.start.shape[1])
        A = np.kron(np.array([[0.0, 1.0], [0.0, 0.0]]), one)
        B = np.kron(np.array([[0.0], [1.0]]), one)
        return Linearisation(A[None, None], B[None, None])

    def state_gradient(self, motion: Motion, cotangent: Cotangent) -> StateGradient:
        """By (q, v) and u."""
        del motion  # Unused.
        return StateGradient(np.concatenate([cotangent.q[:-1], cotangent.v[:-1]], axis=-1), cotangent.u)
