"""Robots stay out of circular obstacles (vertical cylinders), at the steps and between them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from missions.arrays import Array
from planner.constraints.base import Evaluation, Place
from planner.dynamics import Cotangent, Motion


@dataclass(frozen=True)
class Obstacles:
    """g = (r² − d²)/(2 r): metres to first order at the edge, smooth at the centre.

    Attributes:
        center: (O, 2) centres x, y [m].
        radius: (N, O) distance each robot keeps from each centre [m].
        names: of all robots. dt: time between fine samples [s].
    """

    center: Array
    radius: Array
    names: tuple[str, ...]
    dt: float
    name: str = "obstacle clearance"
    unit: str = "m"
    tolerance: float = 1e-3
    swarm_axis: int = 0

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (N, O, S) over the fine samples."""
        delta, squares = self._distances(motion)
        radius = self.radius[..., None]
        residual = (radius**2 - squares) / (2.0 * radius)

        def pull(weights: Array, cotangent: Cotangent) -> None:
            n, o, s = np.nonzero(weights)
            force = (delta[:, n, o, s] * (weights[n, o, s] / self.radius[n, o])).T
            np.subtract.at(cotangent.q_fine[..., :2], (s, n), force)

        return Evaluation(residual, pull)

    def violation(self, motion: Motion) -> Array:
        """Depth inside the obstacle [m], (N, O, S)."""
        _, squares = self._distances(motion)
        depth: Array = self.radius[..., None] - np.sqrt(squares)
        return depth

    def place(self, index: tuple[int, ...]) -> Place:
        """The robot, the obstacle, the instant."""
        robot, obstacle, s = index
        x, y = self.center[obstacle]
        return Place(f"{self.names[robot]}, obstacle at ({x:g}, {y:g})", s * self.dt)

    def stacked(self, swarms: int, robots: int) -> Obstacles:
        """The same for several swarms."""
        del robots  # Unused.
        return replace(self, radius=np.tile(self.radius, (swarms, 1)), names=self.names * swarms)

    def _distances(self, motion: Motion) -> tuple[Array, Array]:
        """Vectors from the centres (2, N, O, S) and their squared lengths (N, O, S): time last, where NumPy is fast."""
        x = np.ascontiguousarray(motion.q_fine.T[:2])  # (2, N, S)
        delta = x[:, :, None] - self.center.T[:, None, :, None]
        return delta, (delta * delta).sum(axis=0)
