"""A differential drive that turns, then moves forwards: θ_t = θ_{t−1} + ω_t, x_t = x_{t−1} + |v_t| (cos θ_t, sin θ_t).

As PlanetaryRobotics' ergodic-search has it: controls are lengths and angles a step, there is no time in it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array, frozen

_LENGTH, _TURN = 0.02, 0.1  # [m], [rad] a step, typically


@dataclass(frozen=True)
class DifferentialDrive:
    """A robot with two wheels on the plane.

    Attributes:
        start: (x, y, θ) before the first step [m, m, rad].
        steps: T.
    """

    start: tuple[float, float, float]
    steps: int

    @property
    def scale(self) -> Array:
        """(2,): lengths a step [m] and turns [rad]."""
        return frozen(np.array([_LENGTH, _TURN]))

    def guess(self, target: Array) -> Array:
        """A turn, then straight on at an even pace, which is never zero: |v| has no slope there."""
        way = np.asarray(target) - np.array(self.start[:2])
        u = np.zeros((self.steps, 2))
        u[:, 0] = max(float(np.hypot(*way)) / self.steps, 0.1 * _LENGTH)
        turn = math.atan2(way[1], way[0]) - self.start[2]
        u[0, 1] = math.remainder(turn, 2.0 * math.pi)
        return u

    def states(self, u: Array) -> Array:
        """(T, 3) x, y [m], θ [rad] after each of the controls (T, 2)."""
        states = np.empty((len(u), 3))
        heading = np.cumsum(u[:, 1]) + self.start[2]
        length = np.abs(u[:, 0])
        np.cumsum(length * np.cos(heading), out=states[:, 0])
        np.cumsum(length * np.sin(heading), out=states[:, 1])
        states[:, 0] += self.start[0]
        states[:, 1] += self.start[1]
        states[:, 2] = heading
        return states

    def pull(self, u: Array, states: Array, to_states: Array) -> Array:
        """Gradient (T, 2) by controls: each length moves all positions from its own on, each turn all that follow."""
        later = np.cumsum(to_states[::-1], axis=0)[::-1]  # (T, 3) gradient by a shift of everything from a step on
        cos, sin = np.cos(states[:, 2]), np.sin(states[:, 2])
        to_u = np.empty_like(u)
        to_u[:, 0] = (cos * later[:, 0] + sin * later[:, 1]) * np.sign(u[:, 0])
        to_heading = np.abs(u[:, 0]) * (cos * later[:, 1] - sin * later[:, 0])
        to_u[:, 1] = np.cumsum(to_heading[::-1])[::-1] + later[:, 2]
        return to_u
