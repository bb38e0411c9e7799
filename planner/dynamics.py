"""Dynamics of the robots: controls in, motion out, and the transpose of that map.

All robots roll out at once. Axis order is time, robot, axis everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from missions.arrays import Array, frozen


class Motion(NamedTuple):
    """What the robots do.

    Attributes:
        q: (T+1, N, ν) positions at the steps [m].
        v: (T+1, N, ν) velocities at the steps [m/s].
        u: (T, N, ν) controls, constant over a step; accelerations [m/s²] for the double integrator.
        q_fine: (mT+1, N, ν) positions at the steps and at m−1 equally spaced instants between them [m].
    """

    q: Array
    v: Array
    u: Array
    q_fine: Array


class Cotangent(NamedTuple):
    """Gradient of a scalar with respect to a motion; terms add to it in place. Shapes as in :class:`Motion`."""

    q: Array
    v: Array
    u: Array
    q_fine: Array

    @classmethod
    def zeros_like(cls, motion: Motion) -> Cotangent:
        """The cotangent of a constant."""
        return cls(*(np.zeros_like(part) for part in motion))


class Dynamics(Protocol):
    """A model of motion."""

    @property
    def controls_shape(self) -> tuple[int, int, int]:
        """(T, N, control axes)."""

    def rollout(self, u: Array) -> Motion:
        """Motion under controls u."""

    def pull(self, motion: Motion, cotangent: Cotangent) -> Array:
        """Transpose of the rollout's derivative at ``motion``: gradient with respect to u."""


@dataclass(frozen=True)
class DoubleIntegrator:
    """Point masses with bounded acceleration, exact for controls that are constant over a step.

    v' = v + u dt, q' = q + v dt + ½ u dt²; robots start at rest.

    Attributes:
        start: (N, ν) positions at t = 0 [m].
        steps: T. dt: step [s].
        substeps: m, positions a step that :attr:`Motion.q_fine` holds.
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

    def rollout(self, u: Array) -> Motion:
        """Motion under accelerations u (T, N, ν) [m/s²]."""
        T, dt, m = self.steps, self.dt, self.substeps
        v = np.zeros((T + 1, *u.shape[1:]))
        np.cumsum(u * dt, axis=0, out=v[1:])
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
