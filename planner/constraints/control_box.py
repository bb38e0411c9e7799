"""Bounds of controls in units of their own: lower ≤ u ≤ upper, control by control."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.constraints.base import Evaluation, Place
from planner.dynamics import Cotangent, Motion


@dataclass(frozen=True)
class ControlBox:
    """g = lower − u and u − upper, in shares of the range: bounds of any unit weigh the same.

    Attributes:
        lower: (m,) least controls. upper: (m,) largest.
        controls: their names. names: of all robots. dt: planning step [s].
    """

    lower: Array
    upper: Array
    controls: tuple[str, ...]
    names: tuple[str, ...]
    dt: float
    tolerance: float = 5e-3
    name: str = "control"
    unit: str = "of its range"

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (2, T, N, m): below the lower bound, above the upper one."""

        def pull(weights: Array, cotangent: Cotangent) -> None:
            cotangent.u[...] += (weights[1] - weights[0]) / (self.upper - self.lower)

        return Evaluation(self.violation(motion), pull)

    def violation(self, motion: Motion) -> Array:
        """Share of the range outside it, (2, T, N, m)."""
        outside: Array = np.stack([self.lower - motion.u, motion.u - self.upper]) / (self.upper - self.lower)
        return outside

    def place(self, index: tuple[int, ...]) -> Place:
        """The robot, the control, the instant."""
        side, t, robot, control = index
        bound = "lower" if side == 0 else "upper"
        return Place(f"{self.names[robot]}, {bound} bound of {self.controls[control]}", t * self.dt)
