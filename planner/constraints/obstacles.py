"""Robots stay out of circular obstacles (vertical cylinders), at the steps and between them."""

from __future__ import annotations

from dataclasses import dataclass

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

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (S, N, O) over the fine samples."""
        delta = self._delta(motion)
        squares = np.einsum("snod,snod->sno", delta, delta)
        residual = (self.radius**2 - squares) / (2.0 * self.radius)

        def pull(weights: Array, cotangent: Cotangent) -> None:
            s, n, o = np.nonzero(weights)
            force = delta[s, n, o] * (weights[s, n, o] / self.radius[n, o])[:, None]
            np.subtract.at(cotangent.q_fine[..., :2], (s, n), force)

        return Evaluation(residual, pull)

    def violation(self, motion: Motion) -> Array:
        """Depth inside the obstacle [m], (S, N, O)."""
        depth: Array = self.radius - np.linalg.norm(self._delta(motion), axis=-1)
        return depth

    def place(self, index: tuple[int, ...]) -> Place:
        """The robot, the obstacle, the instant."""
        s, robot, obstacle = index
        x, y = self.center[obstacle]
        return Place(f"{self.names[robot]}, obstacle at ({x:g}, {y:g})", s * self.dt)

    def _delta(self, motion: Motion) -> Array:
        delta: Array = motion.q_fine[:, :, None, :2] - self.center
        return delta
