"""Robots stay out of a convex obstacle or zone, at the steps and between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from missions.shapes import Solid
from planner.constraints.base import Evaluation, Place
from planner.dynamics import Cotangent, Motion


@dataclass(frozen=True)
class Outside:
    """g = keep − signed distance, in metres; its gradient never vanishes, so a robot inside finds the way out.

    Attributes:
        solid: what to stay out of; robots of a 2-D search need a column, for they have no height to leave through.
        robots: (R,) indices of those it binds.
        keep: (R,) distance each of them keeps from the surface [m].
        label: what it is, in words.
        names: of all robots. dt: time between fine samples [s].
        landing: only the last of the fine samples counts, from where a robot descends.
    """

    solid: Solid
    robots: NDArray[np.intp]
    keep: Array
    label: str
    names: tuple[str, ...]
    dt: float
    landing: bool = False
    name: str = "obstacle clearance"
    unit: str = "m"
    tolerance: float = 1e-3

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (R, S) over the fine samples."""
        x = self._points(motion)

        def pull(weights: Array, cotangent: Cotangent) -> None:
            r, s = np.nonzero(weights)  # few robots are close at any time
            nu = cotangent.q_fine.shape[2]
            force = (self.solid.distance(x[:, r, s]).gradient[:nu] * weights[r, s]).T
            np.subtract.at(cotangent.q_fine[self._samples], (s, self.robots[r]), force)

        return Evaluation(self.keep[:, None] - self.solid.value(x), pull)

    def violation(self, motion: Motion) -> Array:
        """Depth inside [m], (R, S)."""
        return self.evaluate(motion).residual

    def place(self, index: tuple[int, ...]) -> Place:
        """The robot, what it is in, the instant."""
        robot, s = index
        time = s * self.dt if not self.landing else None
        return Place(f"{self.names[self.robots[robot]]}, {self.label}", time)

    def _points(self, motion: Motion) -> Array:
        """(3, R, S) positions, time last; 2-D searches get height 0."""
        q = motion.q_fine[self._samples][:, self.robots]
        x = np.zeros((3, *q.shape[1::-1]))
        x[: q.shape[2]] = q.T
        return x

    @property
    def _samples(self) -> slice:
        return slice(-1, None) if self.landing else slice(None)
