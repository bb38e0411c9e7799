"""Waypoints of all robots to a certified flight plan."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from missions import fleet
from missions.schema import Mission
from planner.flightplan import FlightPlan
from planner.interchange.errors import InterchangeError
from planner.interchange.minimum_snap import choose_times, minimum_snap
from planner.interchange.polynomials import extended, flight_plan_of, sampled_plan
from planner.interchange.waypoints import Waypoints
from planner.trajectory.fit import fit
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.trajectory.poly4d import MAX_PIECES


def flight_through(
    mission: Mission,
    waypoints: Mapping[str, Waypoints],
    *,
    speed: float | None = None,
    acceleration: float | None = None,
) -> FlightPlan:
    """A certified flight plan through waypoints, by polynomials of least snap.

    What float32 pieces have room for flies through the waypoints exactly; longer lists, and missions that ask for the
    compressed format, are fitted anew and pass within ``trajectory.tolerance``.

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
        limits = [
            _limit("speed", speed, float(fleet.speeds(mission)[robot]), "m/s"),
            _limit("acceleration", acceleration, float(fleet.accelerations(mission)[robot]), "m/s²"),
        ]
        try:
            times = choose_times(given.points, *limits) if given.times is None else given.times
        except InterchangeError as error:
            raise InterchangeError(f"{name}: {error}") from None
        trajectories[name] = minimum_snap(times, given.points)
    whole = extended(mission, trajectories)
    long = [name for name, trajectory in whole.items() if _needs_fit(mission, trajectory)]
    for name in long:
        if whole[name].coefficients[:, 3].any():
            raise InterchangeError(
                f"{name}: {whole[name].pieces} pieces with yaw; allowed: {MAX_PIECES}, or encoding poly4d"
            )
    if long:
        fitted = dict(zip(names, fit(sampled_plan(mission, whole), mission), strict=True))
        whole = {name: fitted[name] if name in long else whole[name] for name in names}
    return flight_plan_of(mission, whole)


def _needs_fit(mission: Mission, trajectory: PiecewisePolynomial) -> bool:
    """Whether the pieces would be rounded to millimetres, which only suits pieces chosen for it."""
    encoding = mission.trajectory.encoding
    return encoding == "compressed" or (encoding == "auto" and trajectory.pieces > MAX_PIECES)


def _limit(what: str, asked: float | None, allowed: float, unit: str) -> float:
    if asked is None:
        return allowed
    if not (np.isfinite(asked) and 0.0 < asked <= allowed):
        raise InterchangeError(f"{what}: got {asked:g}; allowed: above 0, at most the mission's {allowed:g} [{unit}]")
    return asked
