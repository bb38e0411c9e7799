"""Robots keep below a speed: |v| ≤ v_max (Euclidean norm)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from missions.arrays import Array
from planner.constraints.base import Evaluation, Place, Rows
from planner.dynamics import Cotangent, Motion


@dataclass(frozen=True)
class Speed:
    """g = (|v|² − v_max²)/(2 v_max): m/s to first order at the limit, smooth at rest.

    Velocity is linear over a step, so |v| is convex and the steps' samples bound it.

    Attributes:
        limit: v_max [m/s]: (N,), or (T+1, N) where it depends on time.
        names: of all robots. dt: planning step [s].
    """

    limit: Array
    names: tuple[str, ...]
    dt: float
    name: str = "speed"
    unit: str = "m/s"
    tolerance: float = 1e-3
    swarm_axis: int = 1

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (T+1, N)."""
        v = motion.v
        residual = (np.einsum("tnd,tnd->tn", v, v) - self.limit**2) / (2.0 * self.limit)

        def pull(weights: Array, cotangent: Cotangent) -> None:
            cotangent.v[...] += v * (weights / self.limit)[..., None]

        return Evaluation(residual, pull)

    def rows(self, motion: Motion, weights: Array) -> Rows:
        """Gradients of the components whose weight is not zero."""
        t, robot = np.nonzero(weights)
        limit = np.broadcast_to(self.limit, weights.shape)[t, robot]
        forces = motion.v[t, robot].T / limit
        return Rows("v", t[None], np.ones((1, len(t))), robot[None], forces[None])

    def violation(self, motion: Motion) -> Array:
        """Speed above the limit [m/s], (T+1, N)."""
        excess: Array = np.linalg.norm(motion.v, axis=-1) - self.limit
        return excess

    def place(self, index: tuple[int, ...]) -> Place:
        """The robot, the instant."""
        return Place(self.names[index[1]], index[0] * self.dt)

    def stacked(self, swarms: int, robots: int) -> Speed:
        """The same for several swarms."""
        del robots  # Unused.
        return replace(self, limit=np.tile(self.limit, swarms), names=self.names * swarms)
