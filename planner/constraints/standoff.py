"""Robots stay within some distance of a surface (FEO, Eq. 28, left)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.constraints.base import Evaluation, Place
from planner.dynamics import Cotangent, Motion


@dataclass(frozen=True)
class NearSurface:
    """g = distance to the nearest of a surface's points − the farthest allowed [m].

    Attributes:
        points: (J, 3) of the surface [m].
        far: (N,) how far each robot may be [m].
        names: of all robots. dt: planning step [s].
    """

    points: Array
    far: Array
    names: tuple[str, ...]
    dt: float
    name: str = "stand-off"
    unit: str = "m"
    tolerance: float = 1e-3
    swarm_axis: int = 1

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (T+1, N)."""
        away = motion.q - self.points[self._nearest(motion.q)]
        distance = np.linalg.norm(away, axis=-1)

        def pull(weights: Array, cotangent: Cotangent) -> None:
            cotangent.q[...] += away * (weights / np.maximum(distance, 1e-9))[..., None]

        return Evaluation(distance - self.far, pull)

    def violation(self, motion: Motion) -> Array:
        """How much too far [m], (T+1, N)."""
        return self.evaluate(motion).residual

    def place(self, index: tuple[int, ...]) -> Place:
        """The robot, the instant."""
        t, robot = index
        return Place(self.names[robot], t * self.dt)

    def stacked(self, swarms: int, robots: int) -> NearSurface:
        """The same for several swarms."""
        del robots  # Unused.
        return replace(self, far=np.tile(self.far, swarms), names=self.names * swarms)

    def _nearest(self, q: Array) -> NDArray[np.intp]:
        """Index (T+1, N) of the nearest point, by |q − r|² = |q|² + |r|² − 2 q·r."""
        squares = np.einsum("jd,jd->j", self.points, self.points) - 2.0 * (q @ self.points.T)
        return np.asarray(squares.argmin(axis=-1))
