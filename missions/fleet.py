"""What holds for each robot: its own value where it has one, the mission's where not. Arrays in the mission's order."""

from __future__ import annotations

import math

import numpy as np

from missions.arrays import Array, frozen
from missions.schema import Mission, Robot

# Half height of the ellipsoid round two Crazyflies in which the upper one's downwash disturbs the lower one [m]:
# half axes of 0.12 m aside and 0.3 m down for each of them (Hönig et al., Trajectory Planning for Quadrotor Swarms,
# IEEE T-RO 2018).
DOWNWASH = 0.6


def starts(mission: Mission) -> Array:
    """(N, ν) where the searches start [m]."""
    return frozen([robot.start[: mission.dimension] for robot in mission.robots])


def ends(mission: Mission) -> Array:
    """(N, ν) where the searches have to end [m]; NaN for robots that may end anywhere."""
    anywhere = (math.nan,) * mission.dimension
    points = [
        robot.start if robot.end == "start" else robot.end if robot.end is not None else anywhere
        for robot in mission.robots
    ]
    return frozen([point[: mission.dimension] for point in points])


def velocities(mission: Mission) -> Array:
    """(N, ν) velocities at the start of the search [m/s]."""
    rest = (0.0,) * mission.dimension
    return frozen([(robot.velocity or rest)[: mission.dimension] for robot in mission.robots])


def accelerations(mission: Mission) -> Array:
    """(N,) largest acceleration per axis [m/s²]."""
    return frozen([robot.limits.acceleration or mission.limits.acceleration for robot in mission.robots])


def speeds(mission: Mission) -> Array:
    """(N,) largest speed [m/s]."""
    return frozen([robot.limits.speed or mission.limits.speed for robot in mission.robots])


def altitudes(mission: Mission) -> Array:
    """(N,) heights of a 2-D search above the floor [m]; of a 3-D search where it starts."""
    if mission.dimension == 3:
        return frozen([robot.start[2] for robot in mission.robots])
    return frozen([robot.altitude or mission.flight.altitude for robot in mission.robots])


def at_different_heights(mission: Mission) -> bool:
    """Whether one robot may be above another: 3-D searches, and 2-D searches in layers."""
    return mission.dimension == 3 or bool(np.ptp(altitudes(mission)) > 0.0)


def vertical_scale(mission: Mission) -> float:
    """By how much vertical distances count less than horizontal ones between robots: a / b of the ellipsoid."""
    limits = mission.limits
    return limits.separation / (limits.vertical_separation or limits.separation or 1.0)


def in_space(mission: Mission, q: Array) -> Array:
    """Positions (..., N, 3) of searches (..., N, ν): robots of a 2-D search fly at their altitudes."""
    if mission.dimension == 3:
        return np.asarray(q, dtype=np.float64)
    z = np.broadcast_to(altitudes(mission), q.shape[:-1])
    return np.concatenate([q, z[..., None]], axis=-1)


def pad_of(robot: Robot) -> tuple[float, float]:
    """(x, y) where a robot takes off [m]: under its start unless the mission says otherwise."""
    x, y = (robot.pad or robot.start)[:2]
    return float(x), float(y)


def pads(mission: Mission) -> Array:
    """(N, 2) where everybody takes off [m]."""
    return frozen([pad_of(robot) for robot in mission.robots])


def transfer_scale(mission: Mission) -> float:
    """As :func:`vertical_scale`, on the way to the search and back, where downwash counts whatever the search says."""
    limits = mission.limits
    return limits.separation / (limits.vertical_separation or max(DOWNWASH, limits.separation))


def fence(mission: Mission) -> tuple[Array, Array]:
    """Lower and upper corner (3,) of the box around floor, workspace, pads and starts, heights included [m].

    Nobody may be farther outside than ``flight.geofence_margin``.
    """
    places = np.concatenate(
        [np.array([mission.workspace.lower[:2], mission.workspace.upper[:2]]), pads(mission), starts(mission)[:, :2]]
    )
    top = float(altitudes(mission).max()) if mission.dimension == 2 else mission.workspace.upper[2]
    return frozen([*places.min(axis=0), 0.0]), frozen([*places.max(axis=0), top])
