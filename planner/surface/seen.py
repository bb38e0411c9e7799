"""What robots have seen of an object, point by point: rays from where they were, not from viewpoints near by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array, frozen
from missions.schema import Mission
from planner.surface.mission import cameras_of, surface_of
from planner.surface.rays import Rays


@dataclass(frozen=True)
class SeenSurface:
    """How long every point of the surface was in each robot's picture, and since when.

    Attributes:
        seconds: (N, J) [s]. first: (N, J) time [s] of the first look at it; inf if there was none.
        share: (J,) of the information on the points.
    """

    seconds: Array
    first: Array
    share: Array

    def __post_init__(self) -> None:
        for name in ("seconds", "first"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def fraction(self) -> float:
        """Share of the information that anybody saw."""
        return float(self.share[self.seconds.max(axis=0) > 0.0].sum())

    @property
    def fractions(self) -> tuple[float, ...]:
        """Share of the information that each robot saw."""
        return tuple(float(self.share[seconds > 0.0].sum()) for seconds in self.seconds)


def seen_surface(mission: Mission, q: Array, heading: Array | None = None) -> SeenSurface:
    """What was seen from positions at the mission's planning steps.

    Args:
        mission: with an object.
        q: (T, N, 3) [m]; where they are NaN nothing is seen.
        heading: (T, N) where robots looked [rad]; None: where they should have.

    Raises:
        PlannerError: an object that was not read, or no library to cast rays with.
    """
    surface = surface_of(mission)
    rays = Rays(surface)
    seconds = np.zeros((q.shape[1], len(surface.points)))
    first = np.full_like(seconds, np.inf)
    t = np.arange(len(q)) * mission.horizon.dt
    for robot, camera in enumerate(cameras_of(mission)):
        known = np.isfinite(q[:, robot]).all(axis=1)
        look = None if heading is None else heading[known, robot]
        picture = camera.picture(rays, q[known, robot], look) > 0.0
        seconds[robot] = mission.horizon.dt * picture.sum(axis=0)
        first[robot] = np.where(picture, t[known, None], np.inf).min(axis=0, initial=np.inf)
    return SeenSurface(seconds, first, surface.share)
