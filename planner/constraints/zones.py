"""Robots stay in a convex zone, at the steps and between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.constraints.base import Evaluation, Place
from planner.dynamics import Cotangent, Motion


@dataclass(frozen=True)
class InsideZone:
    """g = n_e · q − b_e for every edge e of a convex polygon: linear, in metres.

    Attributes:
        normals: (E, 2) outward unit vectors.
        offsets: (R, E) b_e, for each robot [m].
        robots: (R,) indices of those it binds.
        label: which zone, in words.
        names: of all robots. dt: time between fine samples [s].
    """

    normals: Array
    offsets: Array
    robots: NDArray[np.intp]
    label: str
    names: tuple[str, ...]
    dt: float
    name: str = "keep-in zone"
    unit: str = "m"
    tolerance: float = 1e-3

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (R, E, S) over the fine samples."""

        def pull(weights: Array, cotangent: Cotangent) -> None:
            force = np.einsum("res,ea->sra", weights, self.normals)
            cotangent.q_fine[:, self.robots, :2] += force

        return Evaluation(self.violation(motion), pull)

    def violation(self, motion: Motion) -> Array:
        """Distance outside the edges' lines [m], (R, E, S)."""
        q = motion.q_fine[:, self.robots, :2]
        along: Array = np.einsum("sra,ea->res", q, self.normals)
        return along - self.offsets[..., None]

    def place(self, index: tuple[int, ...]) -> Place:
        """The robot, the zone, the instant."""
        robot, _, s = index
        return Place(f"{self.names[self.robots[robot]]}, {self.label}", s * self.dt)
