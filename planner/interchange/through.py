"""Waypoints of all robots to a certified flight plan."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from missions import fleet
from missions.arrays import Array
from missions.schema import FixedYaw, Mission
from planner.flightplan import FlightPlan
from planner.interchange.errors import InterchangeError
from planner.interchange.minimum_snap import choose_times, minimum_snap
from planner.interchange.polynomials import extended, flight_plan_of, sampled_plan
from planner.interchange.waypoints import Waypoints
from planner.trajectory.fit import fit
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.trajectory.poly4d import MAX_PIECES

_FOLLOWABLE = 0.9  # share of the acceleration limit up to which times are chosen for what is fitted anew


def flight_through(
    mission: Mission,
    waypoints: Mapping[str, Waypoints],
    *,
    speed: float | None = None,
    acceleration: float | None = None,
) -> FlightPlan:
    """A certified flight plan through waypoints, by polynomials of least snap.

    What float32 pieces have room for flies through the waypoints exactly. Longer lists, missions that ask for the
    compressed format, and robots that look along their path or at a point are fitted anew and pass within
    ``trajectory.tolerance``.

    Args:
        mission: what is allowed.
        waypoints: by robot name. Times that are not given are the shortest found within the limits.
        speed: largest speed where times are chosen [m/s]; default: the mission's, robot by robot.
        acceleration: largest acceleration an axis where times are chosen [m/s²]; default: as for the speed.

    Raises:
        InterchangeError: limits beyond the mission's, more than 31 pieces with yaw, or as :func:`flight_plan_of`.
        PlannerError: as :func:`flight_plan_of`.
    """
    names = [robot.name for robot in mission.robots]
    trajectories = {}
    for name, given in waypoints.items():
        robot = names.index(name) if name in names else 0  # strangers are refused with all the others
        limits = (
            _limit("speed", speed, float(fleet.speeds(mission)[robot]), "m/s"),
            _limit("acceleration", acceleration, float(fleet.accelerations(mission)[robot]), "m/s²"),
        )
        trajectories[name] = _least_snap(mission, name, given, *limits)
    whole = extended(mission, trajectories)
    long = [name for name, trajectory in whole.items() if _is_fitted(mission, waypoints[name], trajectory.pieces)]
    for name in long:
        if waypoints[name].yaw is not None:
            allowed = f"allowed: at most {MAX_PIECES} pieces, or trajectory.encoding: poly4d"
            raise InterchangeError(f"{name}: {whole[name].pieces} compressed pieces with their own yaw; {allowed}")
    if long:
        fitted = dict(zip(names, fit(sampled_plan(mission, whole), mission), strict=True))
        whole = {name: fitted[name] if name in long else whole[name] for name in names}
    return flight_plan_of(mission, whole)


def _least_snap(
    mission: Mission, name: str, given: Waypoints, speed: float, acceleration: float
) -> PiecewisePolynomial:
    """One robot's trajectory, with times if it has none."""
    points = np.column_stack([given.points, _yaw(mission, given)])
    if given.times is not None:
        return minimum_snap(given.times, points)
    if _is_fitted(mission, given, len(points)):
        acceleration *= _FOLLOWABLE
    try:
        return minimum_snap(choose_times(points, speed, acceleration), points)
    except InterchangeError as error:
        raise InterchangeError(f"{name}: {error}") from None


def _yaw(mission: Mission, given: Waypoints) -> Array:
    """(K,) [rad] as given, or as the mission fixes it; zero where the fit will turn the robot."""
    if given.yaw is not None:
        return given.yaw
    wanted = mission.trajectory.yaw
    return np.full(len(given.points), wanted.angle if isinstance(wanted, FixedYaw) else 0.0)


def _is_fitted(mission: Mission, given: Waypoints, pieces: int) -> bool:
    """Whether pieces are made anew: to turn the robot, or because rounding to millimetres asks for other pieces."""
    turns = given.yaw is None and not isinstance(mission.trajectory.yaw, FixedYaw)
    encoding = mission.trajectory.encoding
    return turns or encoding == "compressed" or (encoding == "auto" and pieces > MAX_PIECES)


def _limit(what: str, asked: float | None, allowed: float, unit: str) -> float:
    if asked is None:
        return allowed
    if not (np.isfinite(asked) and 0.0 < asked <= allowed):
        raise InterchangeError(f"{what}: got {asked:g}; allowed: above 0, at most the mission's {allowed:g} [{unit}]")
    return asked
