"""The metric of a mission that looks at an object."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from missions.footprint import CameraFootprint
from missions.objects import Surface
from missions.schema import Mission, Vector
from missions.trajectory import FacingYaw, FixedYaw
from planner.ergodic.basis import CosineBasis
from planner.errors import PlannerError
from planner.surface.camera import Camera
from planner.surface.metric import SurfaceMetric, Views
from planner.surface.rays import Rays
from planner.surface.views import Grid, looks

PAD = 0.005  # [m] of the box around the surface: of what is flat, too, there is a box


def surface_metric(mission: Mission) -> SurfaceMetric:
    """Ergodic metric of what the mission's cameras see of its object.

    The basis is on the box around the surface: the space of the information, which robots fly around (FEO, III-A).

    Raises:
        PlannerError: an object that was not read, or no library to cast rays with.
    """
    box = mission.workspace
    return _metric(surface_of(mission), mission.basis.functions_per_axis, box.lower, box.upper, cameras_of(mission))


def surface_of(mission: Mission) -> Surface:
    """The mission's object as it was read.

    Raises:
        PlannerError: there is none.
    """
    if mission.object is None or mission.object.surface is None:
        raise PlannerError("the mission's object was not read: its surface is missing")
    return mission.object.surface


def cameras_of(mission: Mission) -> tuple[Camera, ...]:
    """Every robot's camera.

    Raises:
        TypeError: footprints of another kind, or robots that look along their path.
    """
    lenses, yaw = mission.footprints, mission.trajectory.yaw
    if not isinstance(yaw, FacingYaw | FixedYaw):
        raise TypeError(f"cameras look at something or in one direction; got yaw of type {yaw.type}")
    found = tuple(Camera(lens, yaw) for lens in lenses if isinstance(lens, CameraFootprint))
    if len(found) != len(mission.robots):
        raise TypeError("every robot that looks at an object does so with a camera")
    return found


@lru_cache(maxsize=4)  # a search builds its problem several times, with other steps and margins
def _metric(surface: Surface, n: int, lower: Vector, upper: Vector, cameras: tuple[Camera, ...]) -> SurfaceMetric:
    basis = CosineBasis(surface.lower - PAD, surface.upper + PAD, n)
    views = {camera: _views(surface, camera, lower, upper) for camera in set(cameras)}
    return SurfaceMetric(basis, surface.points, surface.share, tuple(views[camera] for camera in cameras))


@lru_cache(maxsize=4)
def _views(surface: Surface, camera: Camera, lower: Vector, upper: Vector) -> Views:
    grid = Grid.over(np.array(lower), np.array(upper))
    return Views(grid, looks(camera, Rays(surface), grid.nodes()))
