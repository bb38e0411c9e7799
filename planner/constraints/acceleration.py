"""Control bounds: |u| ≤ u_max per axis."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from missions.arrays import Array
from planner.constraints.base import Evaluation, Place, Rows
from planner.dynamics import Cotangent, Motion


@dataclass(frozen=True)
class ControlBound:
    """g = (u² − u_max²)/(2 u_max): both bounds in one, m/s² to first order at the limit.

    Attributes:
        limit: (N,) u_max [m/s²].
        names: of all robots. dt: planning step [s].
    """

    limit: Array
    names: tuple[str, ...]
    dt: float
    tolerance: float
    name: str = "acceleration"
    unit: str = "m/s²"
    swarm_axis: int = 1

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (T, N, ν)."""
        u, limit = motion.u, self.limit[:, None]

        def pull(weights: Array, cotangent: Cotangent) -> None:
            cotangent.u[...] += u * (weights / limit)

        return Evaluation((u * u - limit**2) / (2.0 * limit), pull)

    def rows(self, motion: Motion, weights: Array) -> Rows:
        """Gradients of the components whose weight is not zero."""
        t, robot, axis = np.nonzero(weights)
        forces = np.zeros((1, motion.u.shape[2], len(t)))
        forces[0, axis, np.arange(len(t))] = motion.u[t, robot, axis] / self.limit[robot]
        return Rows("u", t[None], np.ones((1, len(t))), robot[None], forces)

    def violation(self, motion: Motion) -> Array:
        """Acceleration above the bound [m/s²], (T, N, ν)."""
        excess: Array = np.abs(motion.u) - self.limit[:, None]
        return excess

    def place(self, index: tuple[int, ...]) -> Place:
        """The robot, the axis, the instant."""
        t, robot, axis = index
        return Place(f"{self.names[robot]}, {'xyz'[axis]}", t * self.dt)

    def stacked(self, swarms: int, robots: int) -> ControlBound:
        """The same for several swarms."""
        del robots  # Unused.
        return replace(self, limit=np.tile(self.limit, swarms), names=self.names * swarms)
