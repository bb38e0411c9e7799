"""Robots stay out of a convex obstacle or zone, within steps too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from missions.shapes import Solid
from planner.constraints.base import Evaluation, Place
from planner.constraints.paths import Paths, When, place_at, push, shares
from planner.dynamics import Cotangent, Motion

NEAR = 0.2  # [m] of room from which on the step's ends will do


@dataclass(frozen=True)
class Outside:
    """g = keep − smallest signed distance in a step [m]; its gradient never vanishes: who is inside finds the way out.

    The distance to a corner has kinks, so the smallest one of a step is that of ``looks`` points of it, not a root.

    Attributes:
        solid: what to stay out of; robots of a 2-D search need a column, for they have no height to leave through.
        robots: (R,) indices of those it binds.
        keep: (R,) distance each of them keeps from the surface [m].
        label: what it is, in words.
        names: of all robots. dt: planning step [s].
        looks: points of a step that are looked at, beside its start, where a robot is near.
        when: at every instant, at samples, or at the end only, from where a robot descends.
    """

    solid: Solid
    robots: NDArray[np.intp]
    keep: Array
    label: str
    names: tuple[str, ...]
    dt: float
    looks: int = 2
    when: When = When.ALWAYS
    name: str = "obstacle clearance"
    unit: str = "m"
    tolerance: float = 1e-3

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (R, K) over the steps (or samples)."""
        paths = Paths.of(motion, self.when)
        value, at = self._nearest(paths)

        def pull(weights: Array, cotangent: Cotangent) -> None:
            r, k = np.nonzero(weights)  # few robots are close at any time
            robots, share = self.robots[r], paths.shares(at[r, k])
            outward = self.solid.distance(_in_space(place_at(paths.at(robots, k), share))).gradient
            force = -outward[: len(paths.x)] * weights[r, k]
            push(cotangent.q_fine, paths.sample[:, k], share, robots, force)

        return Evaluation(self.keep[:, None] - value, pull)

    def violation(self, motion: Motion) -> Array:
        """Depth inside [m], (R, K)."""
        return self.evaluate(motion).residual

    def place(self, index: tuple[int, ...]) -> Place:
        """The robot, what it is in, the step."""
        robot, k = index
        time = k * self.dt if self.when is not When.END else None
        return Place(f"{self.names[self.robots[robot]]}, {self.label}", time)

    def _nearest(self, paths: Paths) -> tuple[Array, Array]:
        """Smallest signed distance (R, K) in every span [m], and when in it."""
        value = self.solid.value(_in_space(paths.points[0][:, self.robots]))
        at = np.zeros_like(value)
        if self.when is not When.ALWAYS:
            return value, at
        low, high = paths.boxes(1)
        reach = np.sqrt(((high - low) ** 2).sum(axis=0))[self.robots]  # nobody goes farther within a span
        r, k = np.nonzero(value - reach < self.keep[:, None] + NEAR)
        s = np.arange(1, self.looks + 1) / self.looks
        points = place_at(paths.at(self.robots[r], k)[..., None], shares(s)[:, None])
        looked = np.concatenate([value[r, k, None], self.solid.value(_in_space(points))], axis=1)
        best = looked.argmin(axis=1)
        value[r, k], at[r, k] = looked[np.arange(len(r)), best], best / self.looks
        return value, at


def _in_space(x: Array) -> Array:
    """(3, ...) points; those of a 2-D search get height 0."""
    return x if len(x) == 3 else np.concatenate([x, np.zeros((1, *x.shape[1:]))])
