"""What no single field can say: checks of a mission's records against each other.

Every check raises at the path of the value a user would change. Nothing here is a matter of taste: a mission that is
refused cannot be planned, or would be dangerous to fly.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable

from missions import decks, dynamics
from missions.airframes import Airframe, airframe
from missions.errors import MissionError
from missions.radio import drones_sharing
from missions.schema import (
    Mission,
    NoConnectivity,
    ProbabilisticConnectivity,
    SimultaneousConnectivity,
)
from missions.uris import check_uri, same_drone
from missions.validate_connectivity import check_connectivity
from missions.validate_information import check_information
from missions.validate_object import check_object
from missions.validate_places import check_limits, check_places
from missions.validate_replanning import check_replanning
from missions.validate_shapes import check_shapes

ErrorAt = Callable[[str, str], MissionError]
MAX_STEPS = 36_000
_PARAMETER = re.compile(r"[A-Za-z0-9_]{1,26}\.[A-Za-z0-9_]{1,26}")
_RADIO_SHARED = "radio.drones_per_dongle"


def validate(mission: Mission, error: ErrorAt) -> None:
    """Check a mission as a whole.

    Args:
        mission: as read, before its map file is read.
        error: makes the MissionError for a reason and a path, e.g. ``RecordReader.error``.

    Raises:
        MissionError: the first thing found wrong.
    """
    frame = _airframe(mission, error)
    _check_workspace(mission, error)
    _check_horizon(mission, error)
    check_object(mission, frame, error)
    check_information(mission, error)
    _check_dynamics(mission, error)
    check_limits(mission, frame, error)
    check_shapes(mission, error)
    _check_identities(mission, error)
    check_places(mission, frame, error)
    _check_parameters(mission, error)
    _check_radio(mission, error)
    _check_safety(mission, error)
    check_connectivity(mission, error)
    _check_assignment(mission, error)
    check_replanning(mission, error)


def _check_safety(mission: Mission, error: ErrorAt) -> None:
    fewest, count = mission.safety.min_robots, len(mission.robots)
    if fewest is not None and fewest > count:
        raise error(f"got {fewest}; allowed: at most {count}, as many robots as there are", "safety.min_robots")


def _airframe(mission: Mission, error: ErrorAt) -> Airframe:
    try:
        return airframe(mission.flight.airframe)
    except MissionError as unknown:
        raise error(unknown.reason, "flight.airframe") from None


# ------------------------------------------------------------------------------------------------ where and when


def _check_workspace(mission: Mission, error: ErrorAt) -> None:
    lower, upper = mission.workspace.lower, mission.workspace.upper
    if len(lower) != len(upper):
        raise error(f"got {len(upper)} numbers; allowed: {len(lower)}, as 'lower' has", "workspace.upper")
    for axis, (low, high) in enumerate(zip(lower, upper, strict=True)):
        if not high - low >= 0.1:
            raise error(
                f"got {high:g} over a lower corner of {low:g}; allowed: at least {low + 0.1:g} [m]",
                f"workspace.upper[{axis}]",
            )
        if max(abs(low), abs(high)) > 1000.0:
            raise error("workspace further than 1000 m from the origin; units are metres", "workspace")
    if len(lower) == 3 and lower[2] < 0.0:
        raise error(f"got {lower[2]:g}; allowed: at least 0 [m], the floor", "workspace.lower[2]")


def _check_horizon(mission: Mission, error: ErrorAt) -> None:
    duration, dt = mission.horizon.duration, mission.horizon.dt
    steps = duration / dt
    if not math.isclose(steps, round(steps), rel_tol=1e-9, abs_tol=1e-6):
        near = " or ".join(f"{n * dt:g}" for n in (math.floor(steps), math.ceil(steps)) if n >= 2)
        raise error(f"got {duration:g}; allowed: a whole multiple of dt = {dt:g}, e.g. {near} [s]", "horizon.duration")
    if not 2 <= round(steps) <= MAX_STEPS:
        raise error(f"got {round(steps)} steps of {dt:g} s; allowed: 2 to {MAX_STEPS} steps", "horizon.duration")


# ------------------------------------------------------------------------------------------------------ dynamics


def _check_dynamics(mission: Mission, error: ErrorAt) -> None:
    if found := dynamics.fault(mission.dynamics, mission.dimension):
        where, reason = found
        raise error(reason, f"dynamics.{where}")


# -------------------------------------------------------------------------------------------------------- robots


def _check_identities(mission: Mission, error: ErrorAt) -> None:
    robots = mission.robots
    for i, robot in enumerate(robots):
        if reason := check_uri(robot.uri):
            raise error(reason, f"robots[{i}].uri")
        if "\n" in robot.rigid_body or "\t" in robot.rigid_body:
            raise error("got a line break or tab; allowed: the body's name", f"robots[{i}].rigid_body")
        if found := decks.fault(robot.decks):
            k, reason = found
            raise error(reason, f"robots[{i}].decks[{k}]")
    # Names become file names, and file systems that ignore case would let one robot overwrite the other.
    _check_unique((r.name.casefold() for r in robots), [r.name for r in robots], "name", error)
    _check_unique((r.rigid_body or r.name for r in robots), [r.name for r in robots], "rigid_body", error)
    _check_unique((same_drone(r.uri) for r in robots), [r.name for r in robots], "uri", error)


def _check_unique(keys: Iterable[str], names: list[str], field: str, error: ErrorAt) -> None:
    seen: dict[str, int] = {}
    for i, key in enumerate(keys):
        if key and key in seen:
            raise error(f"the same as robots[{seen[key]}]'s ({names[seen[key]]}); each needs its own", _at(i, field))
        seen[key] = i


def _check_assignment(mission: Mission, error: ErrorAt) -> None:
    """Who exchanges his start with another takes his meetings with him: that must not matter."""
    policy = mission.connectivity
    if mission.flight.assignment == "fixed" or isinstance(policy, NoConnectivity):
        return
    own = isinstance(policy, ProbabilisticConnectivity | SimultaneousConnectivity) and policy.thresholds
    if policy.pairs != "all" or own:
        reason = "got cheapest, with pairs that depend on who starts where; allowed: fixed, or cheapest with"
        raise error(f"{reason} 'connectivity.pairs: all' and one threshold", "flight.assignment")


def _check_parameters(mission: Mission, error: ErrorAt) -> None:
    for name in mission.flight.parameters:
        if not _PARAMETER.fullmatch(name):
            raise error("allowed: 'group.name' of an on-board parameter", f"flight.parameters.{name[:60]!r}")


def _check_radio(mission: Mission, error: ErrorAt) -> None:
    stated, shared = mission.radio.drones_per_dongle, max(drones_sharing(mission.robots))
    known = any(robot.uri for robot in mission.robots)
    if stated is not None and known and stated < shared:
        raise error(f"got {stated}; allowed: at least {shared}, as many as share one by their URIs", _RADIO_SHARED)


def _at(index: int, field: str) -> str:
    return f"robots[{index}].{field}"
