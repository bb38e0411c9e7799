"""Robots stay inside the workspace."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from missions.arrays import Array
from planner.constraints.base import Evaluation, Place, Rows
from planner.dynamics import Cotangent, Motion


@dataclass(frozen=True)
class Inside:
    """A box for every robot: g = lower − q and q − upper.

    Attributes:
        lower: (N, ν) [m]. upper: (N, ν) [m].
        names: of all robots. dt: planning step [s].
    """

    lower: Array
    upper: Array
    names: tuple[str, ...]
    dt: float
    name: str = "workspace"
    unit: str = "m"
    tolerance: float = 1e-3
    swarm_axis: int = 2

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (2, T+1, N, ν): below the lower bound, above the upper one."""

        def pull(weights: Array, cotangent: Cotangent) -> None:
            cotangent.q[...] += weights[1] - weights[0]

        return Evaluation(self.violation(motion), pull)

    def rows(self, motion: Motion, weights: Array) -> Rows:
        """Gradients of the components whose weight is not zero."""
        side, t, robot, axis = np.nonzero(weights)
        forces = np.zeros((1, motion.q.shape[2], len(t)))
        forces[0, axis, np.arange(len(t))] = 2.0 * side - 1.0
        return Rows("q", t[None], np.ones((1, len(t))), robot[None], forces)

    def violation(self, motion: Motion) -> Array:
        """Distance outside the box [m], (2, T+1, N, ν)."""
        return np.stack([self.lower - motion.q, motion.q - self.upper])

    def place(self, index: tuple[int, ...]) -> Place:
        """The robot, the side, the instant."""
        side, t, robot, axis = index
        return Place(f"{self.names[robot]}, {'lower' if side == 0 else 'upper'} {'xyz'[axis]}", t * self.dt)

    def stacked(self, swarms: int, robots: int) -> Inside:
        """The same for several swarms."""
        del robots  # Unused.
        lower, upper = np.tile(self.lower, (swarms, 1)), np.tile(self.upper, (swarms, 1))
        return replace(self, lower=lower, upper=upper, names=self.names * swarms)
