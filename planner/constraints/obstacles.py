"""Robots stay out of circular obstacles (vertical cylinders), at every instant."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from missions.arrays import Array
from planner.constraints.base import Evaluation, Place, Rows
from planner.constraints.blocks import box_gaps
from planner.constraints.paths import (
    EXACT,
    SEARCHED,
    Closest,
    Indices,
    Paths,
    When,
    acting,
    closest,
    place_at,
    push,
)
from planner.dynamics import Cotangent, Motion

FAR = 1.5  # radii of distance from which on it does not matter how far


@dataclass(frozen=True)
class Obstacles:
    """g = (r² − d²)/(2 r) at the closest approach of a step: metres to first order at the edge, smooth at the centre.

    Attributes:
        center: (O, 2) centres x, y [m].
        radius: (N, O) distance each robot keeps from each centre [m].
        names: of all robots. dt: planning step [s].
        when: at every instant, along chords, or at samples only.
    """

    center: Array
    radius: Array
    names: tuple[str, ...]
    dt: float
    when: When = When.ALWAYS
    name: str = "obstacle clearance"
    unit: str = "m"
    tolerance: float = 1e-3
    swarm_axis: int = 0

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (N, O, K) over the steps (or samples); constant, and far below zero, from ``FAR`` radii on."""
        paths = Paths.of(motion, self.when)
        squares, at = self._closest(paths)
        radius = self.radius[..., None]
        residual = (radius**2 - squares) / (2.0 * radius)

        def pull(weights: Array, cotangent: Cotangent) -> None:
            n, o, k = acting(weights, at)
            _, samples, share, _, (force,) = self._rows(paths, at, n, o, k)
            push(cotangent.q_fine, samples, share, n, force * weights[n, o, k])

        return Evaluation(residual, pull)

    def rows(self, motion: Motion, weights: Array) -> Rows:
        """Gradients of the components whose weight is not zero."""
        paths = Paths.of(motion, self.when)
        _, at = self._closest(paths)
        return self._rows(paths, at, *acting(weights, at))

    def _rows(self, paths: Paths, at: Array, n: Indices, o: Indices, k: Indices) -> Rows:
        """Gradients of robots n at obstacles o in spans k."""
        share = paths.shares(at[n, o, k])
        force = place_at(self._from_center(paths, n, o, k), share) / -self.radius[n, o]
        return Rows("q_fine", paths.sample[:, k], share, n[None], force[None])

    def violation(self, motion: Motion) -> Array:
        """Depth inside the obstacle [m], (N, O, K); far from it no less than what says so."""
        squares, _ = self._closest(Paths.of(motion, self.when), EXACT)
        depth: Array = self.radius[..., None] - np.sqrt(squares)
        return depth

    def place(self, index: tuple[int, ...]) -> Place:
        """The robot, the obstacle, the step."""
        robot, obstacle, k = index
        x, y = self.center[obstacle]
        span = self.dt if self.when is When.ALWAYS else 0.5 * self.dt
        return Place(f"{self.names[robot]}, obstacle at ({x:g}, {y:g})", k * span)

    def stacked(self, swarms: int, robots: int) -> Obstacles:
        """The same for several swarms."""
        del robots  # Unused.
        return replace(self, radius=np.tile(self.radius, (swarms, 1)), names=self.names * swarms)

    def _closest(self, paths: Paths, parts: int = SEARCHED) -> Closest:
        """Closest approaches (N, O, K) to the centres, capped at ``FAR`` radii."""
        center = self.center.T[:, None, :, None]
        if self.when is not When.ALWAYS:
            return closest(paths.windows(paths.x[:2, :, None] - center))
        low, high = (corner[:2, :, None] for corner in paths.boxes(1))
        reach = FAR * self.radius
        n, o, k = np.nonzero(box_gaps(low, high, center, center) < reach[..., None] ** 2)
        squares = np.repeat(reach[..., None] ** 2, paths.sample.shape[1], axis=2)
        at = np.full_like(squares, np.nan)
        found = closest(self._from_center(paths, n, o, k), parts)
        squares[n, o, k], at[n, o, k] = found.capped(reach[n, o])
        return Closest(squares, at)

    def _from_center(self, paths: Paths, n: Indices, o: Indices, k: Indices) -> Array:
        """Start, middle and end (3, 2, M) of robots n in spans k, seen from obstacles o."""
        return paths.at(n, k)[:, :2] - self.center.T[:, o]
