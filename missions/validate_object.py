"""Checks of the mission's object: of what the file says, and of the surface when it has been read."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from missions.airframes import Airframe
from missions.arrays import Array
from missions.errors import MissionError
from missions.footprint import CameraFootprint
from missions.objects import Surface
from missions.schema import FacingYaw, FixedYaw, Mission, SeveralMaps

ErrorAt = Callable[[str, str], MissionError]
MOST_FUNCTIONS = 12  # an axis: 1728 in all, more than there is to see of a surface
SMALLEST = 0.02  # [m] of a thing that drones look at
HUGE = 3.0  # sides of the workspace from which on it is the unit that is wrong, not the place
SLACK = 1e-6  # [m]


def check_object(mission: Mission, frame: Airframe, error: ErrorAt) -> None:
    """Check an object and who looks at it, before the file is read.

    Raises:
        MissionError: the first thing found wrong.
    """
    item = mission.object
    cameras = [isinstance(footprint, CameraFootprint) for footprint in mission.footprints]
    if item is None:
        if any(cameras):
            where = "footprint" if isinstance(mission.footprint, CameraFootprint) else _at(cameras.index(True))
            raise error("got a camera without an object; allowed: with an object that it looks at", where)
        return
    if mission.dimension != 3:
        raise error("got an object in a 2-D workspace; allowed: three numbers a corner", "workspace.lower")
    if mission.footprint is None:
        raise error("missing key 'footprint': an object is looked at by cameras; allowed: of type camera", "")
    if not all(cameras):
        where = _at(cameras.index(False)) if mission.robots[cameras.index(False)].footprint else "footprint"
        raise error("got a footprint on the floor with an object; allowed: camera", where)
    if item.near < frame.radius:
        reason = f"got {item.near:g}; allowed: at least {frame.radius:g} [m], the radius of {mission.flight.airframe}"
        raise error(reason, "object.near")
    if item.far is not None and item.far <= item.near:
        raise error(f"got {item.far:g}; allowed: more than near = {item.near:g} [m]", "object.far")
    if item.facing is not None and math.hypot(*item.facing) < 1e-9:
        raise error("got no direction; allowed: a vector of some length", "object.facing")
    if isinstance(mission.information, SeveralMaps):
        raise error("got several with an object; allowed: one map", "information.type")
    if not isinstance(mission.trajectory.yaw, FixedYaw | FacingYaw):
        reason = f"got {mission.trajectory.yaw.type} with an object; allowed: facing or fixed; default: facing it"
        raise error(reason, "trajectory.yaw")
    if mission.basis.functions_per_axis > MOST_FUNCTIONS:
        reason = f"got {mission.basis.functions_per_axis}; allowed: at most {MOST_FUNCTIONS} with an object"
        raise error(reason, "basis.functions_per_axis")


def check_placed(mission: Mission, vertices: Array, error: ErrorAt) -> None:
    """Check that a surface has the size and the place of something that robots can fly around.

    Args:
        mission: with the object.
        vertices: (V, 3) of the surface in the world frame [m].
        error: makes the MissionError for a reason and a path.

    Raises:
        MissionError: nothing like the workspace in size, or not in it.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    size = high - low
    box = np.array([mission.workspace.lower, mission.workspace.upper])
    box[0, 2] = 0.0  # things stand on the floor
    largest = float(size.max())
    if largest > HUGE * float((box[1] - box[0]).max()) or largest < SMALLEST:
        better = (mission.object.scale if mission.object else 1.0) * (1e-3 if largest > 1.0 else 1e3)
        raise error(
            f"the object is {_times(size)} m in a workspace of {_times(box[1] - box[0])} m; is its unit another? "
            f"allowed: a scale at which it fits, e.g. {better:g} [m]",
            "object.scale",
        )
    if (low < box[0] - SLACK).any() or (high > box[1] + SLACK).any():
        raise error(
            f"the object reaches from {_point(low)} to {_point(high)}, outside the workspace; "
            f"allowed: {_point(box[0])} to {_point(box[1])} [m], the floor included",
            "object.position",
        )


def check_reached(mission: Mission, surface: Surface, error: ErrorAt) -> None:
    """Check that robots begin, and end if told where, no farther from the object than they may be.

    Raises:
        MissionError: names the first who does not.
    """
    far = mission.object.far if mission.object else None
    if far is None:
        return
    for i, robot in enumerate(mission.robots):
        for key in ("start", "end"):
            point = getattr(robot, key)
            if point is None or isinstance(point, str):
                continue
            distance = float(np.linalg.norm(surface.points - np.array(point), axis=1).min())
            if distance > far + SLACK:
                reason = f"got {_point(np.array(point))}, {distance:.3g} m from the object"
                raise error(f"{reason}; allowed: at most object.far = {far:g} [m]", f"robots[{i}].{key}")


def _at(robot: int) -> str:
    return f"robots[{robot}].footprint"


def _times(size: Array) -> str:
    return " × ".join(f"{value:.3g}" for value in size)


def _point(x: Array) -> str:
    return f"({', '.join(f'{value:.3g}' for value in x)})"
