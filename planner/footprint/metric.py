"""The footprint ergodic metric E = Σ_k Λ_k (c_γ,k − φ_k)² of one or several robots (FEO, Eq. 6 and 26)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.ergodic.basis import CosineBasis
from planner.ergodic.metric import MetricValue
from planner.footprint.base import Footprint, Look


@dataclass(frozen=True)
class FootprintMetric:
    """Distance between what robots look at and where the information is.

    Attributes:
        basis: cosine basis on the plane of the information, two axes.
        phi_k: (n, n) coefficients of the information map, φ_0 = 1.
        footprints: one a robot.
        ground: height of the plane [m]: footprints grow with the height above it.
        altitude: (N,) [m] where robots that plan in two axes fly; None: positions have three axes.
    """

    basis: CosineBasis
    phi_k: Array
    footprints: tuple[Footprint, ...]
    ground: float = 0.0
    altitude: Array | None = None

    def statistics(self, q: Array) -> Array:
        """c_k of what robots at q (T, N, ν) [m] look at, (n, n): every robot and step counts alike (FEO, Eq. 26)."""
        return self._look(q)[0]

    def statistics_each(self, q: Array) -> Array:
        """The same of every step by itself, (T, n, n), seen as robots move from one to the next."""
        x, parts = self._in_space(q), np.zeros((len(q), *self.phi_k.shape))
        for footprint, robots in self._groups():
            parts += len(robots) / q.shape[1] * footprint.each(self.basis, x[:, robots])
        return parts

    def value(self, q: Array) -> float:
        """E for positions q (T, N, ν) [m]."""
        return float(np.sum(self.basis.Lambda_k * (self.statistics(q) - self.phi_k) ** 2))

    def evaluate(self, q: Array) -> MetricValue:
        """E and dE/dq (T, N, ν) [1/m]."""
        c_k, looks = self._look(q)
        error = c_k - self.phi_k
        weighted = self.basis.Lambda_k * error
        gradient = np.empty(q.shape)
        for robots, look in looks:
            share = len(robots) / q.shape[1]
            gradient[:, robots] = look.pull(2.0 * share * weighted)[..., : q.shape[2]]
        return MetricValue(float(np.vdot(weighted, error)), gradient)

    def evaluate_each(self, points: Array) -> tuple[Array, Array]:
        """E (B,) of each of B swarms' positions (B, T·N, ν) [m], and the gradient (B, T·N, ν) [1/m]."""
        swarms, _, nu = points.shape
        each = [self.evaluate(q) for q in points.reshape(swarms, -1, len(self.footprints), nu)]
        return np.array([E for E, _ in each]), np.stack([gradient for _, gradient in each]).reshape(points.shape)

    def _look(self, q: Array) -> tuple[Array, list[tuple[list[int], Look]]]:
        x = self._in_space(q)
        looks = [(robots, footprint.look(self.basis, x[:, robots])) for footprint, robots in self._groups()]
        parts = [len(robots) / q.shape[1] * look.c_k for robots, look in looks]
        return sum(parts[1:], parts[0]), looks

    def _groups(self) -> Sequence[tuple[Footprint, list[int]]]:
        """Robots by footprint: those with the same one are looked at together."""
        groups: dict[Footprint, list[int]] = {}
        for robot, footprint in enumerate(self.footprints):
            groups.setdefault(footprint, []).append(robot)
        return list(groups.items())

    def _in_space(self, q: Array) -> Array:
        """(T, N, 3) positions [m], heights above the ground."""
        if self.altitude is None:
            above: Array = q - np.array([0.0, 0.0, self.ground])
            return above
        heights = np.broadcast_to(self.altitude - self.ground, q.shape[:-1])
        return np.concatenate((q, heights[..., None]), axis=-1)
