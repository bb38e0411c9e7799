"""What no single field can say: checks of a mission's records against each other.

Every check raises at the path of the value a user would change. Nothing here is a matter of taste: a mission that is
refused cannot be planned, or would be dangerous to fly.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Iterable

import numpy as np

from missions import dynamics
from missions.airframes import Airframe, airframe
from missions.arrays import Array
from missions.errors import MissionError
from missions.schema import Gaussian, GaussianMixtureMap, Mission, Vector
from missions.uris import check_uri, same_drone
from missions.validate_connectivity import check_connectivity

ErrorAt = Callable[[str, str], MissionError]
MAX_STEPS = 36_000
_SLACK = 1e-9  # [m] rounding allowed where a value may lie on a limit
_PARAMETER = re.compile(r"[A-Za-z0-9_]{1,26}\.[A-Za-z0-9_]{1,26}")
_OUTSIDE_SIGMAS = 6.0


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
    _check_information(mission, error)
    _check_dynamics(mission, error)
    _check_limits(mission, frame, error)
    _check_obstacles(mission, error)
    _check_identities(mission, error)
    _check_starts(mission, error)
    _check_pads(mission, frame, error)
    _check_parameters(mission, error)
    check_connectivity(mission, error)


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


# ---------------------------------------------------------------------------------------------- information maps


def _check_information(mission: Mission, error: ErrorAt) -> None:
    if isinstance(mission.information, GaussianMixtureMap):
        for i, component in enumerate(mission.information.components):
            _check_gaussian(mission, component, f"information.components[{i}]", error)


def _check_gaussian(mission: Mission, gaussian: Gaussian, where: str, error: ErrorAt) -> None:
    nu = mission.dimension
    if len(gaussian.mean) != nu:
        raise error(f"got {len(gaussian.mean)} numbers; allowed: {nu}, as the workspace has", f"{where}.mean")
    matrix = _covariance(gaussian, nu)
    if matrix is None:
        allowed = f"a number, {nu} numbers, or a {nu} × {nu} matrix [m²]"
        raise error(f"got {str(gaussian.covariance)[:60]}; allowed: {allowed}", f"{where}.covariance")
    if not np.allclose(matrix, matrix.T, rtol=1e-9, atol=0.0):
        raise error("got a matrix that is not symmetric; allowed: a symmetric one [m²]", f"{where}.covariance")
    least = float(np.linalg.eigvalsh(matrix)[0])
    if not least > 1e-12 * float(np.abs(matrix).max()):
        raise error(
            f"not positive definite (least eigenvalue {least:.3g}); allowed: above 0 [m²]", f"{where}.covariance"
        )
    box = zip(mission.workspace.lower, mission.workspace.upper, gaussian.mean, np.diag(matrix), strict=True)
    for low, high, mean, variance in box:
        # All of the Gaussian that is in the workspace is in this slab, so less than 1e-9 of it is in the workspace.
        if max(low - mean, mean - high) > _OUTSIDE_SIGMAS * math.sqrt(variance):
            raise error("this Gaussian has nothing inside the workspace; is its centre right?", f"{where}.mean")


def _covariance(gaussian: Gaussian, nu: int) -> Array | None:
    """The full covariance matrix; None if the shape is wrong."""
    value = gaussian.covariance
    if isinstance(value, float):
        return value * np.eye(nu)
    if any(isinstance(row, tuple) and len(row) != nu for row in value):
        return None
    array = np.array(value, dtype=np.float64)
    if array.shape == (nu,):
        return np.diag(array)
    return array if array.shape == (nu, nu) else None


# -------------------------------------------------------------------------------------------- limits, obstacles


def _check_dynamics(mission: Mission, error: ErrorAt) -> None:
    if found := dynamics.fault(mission.dynamics, mission.dimension):
        where, reason = found
        raise error(reason, f"dynamics.{where}")


def _check_limits(mission: Mission, frame: Airframe, error: ErrorAt) -> None:
    limits, name = mission.limits, mission.flight.airframe
    for field, allowed, unit in (
        ("speed", frame.speed_limit, "m/s"),
        ("acceleration", frame.acceleration_limit, "m/s²"),
    ):
        if getattr(limits, field) > allowed:
            reason = f"got {getattr(limits, field):g}; allowed: at most {allowed:g} [{unit}] for airframe {name}"
            raise error(reason, f"limits.{field}")
    if len(mission.robots) > 1 and limits.separation < 2.0 * frame.radius:
        reason = f"got {limits.separation:g}; allowed: at least {2.0 * frame.radius:g} [m], two bodies of {name}"
        raise error(reason, "limits.separation")


def _check_obstacles(mission: Mission, error: ErrorAt) -> None:
    if not mission.obstacles:
        return
    lower, upper = mission.workspace.lower, mission.workspace.upper
    axes = [np.linspace(low, high, 61) for low, high in zip(lower[:2], upper[:2], strict=True)]
    x, y = np.meshgrid(*axes, indexing="ij")
    free = np.ones_like(x, dtype=bool)
    for obstacle in mission.obstacles:
        free &= np.hypot(x - obstacle.center[0], y - obstacle.center[1]) >= obstacle.radius
    if not free.any():
        raise error("the obstacles cover the whole workspace", "obstacles")


# -------------------------------------------------------------------------------------------------------- robots


def _check_identities(mission: Mission, error: ErrorAt) -> None:
    robots = mission.robots
    for i, robot in enumerate(robots):
        if reason := check_uri(robot.uri):
            raise error(reason, f"robots[{i}].uri")
        if "\n" in robot.rigid_body or "\t" in robot.rigid_body:
            raise error("got a line break or tab; allowed: the body's name", f"robots[{i}].rigid_body")
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


def _check_starts(mission: Mission, error: ErrorAt) -> None:
    lower, upper = mission.workspace.lower, mission.workspace.upper
    for i, robot in enumerate(mission.robots):
        if len(robot.start) != mission.dimension:
            count = len(robot.start)
            raise error(f"got {count} numbers; allowed: {mission.dimension}, as the workspace has", _at(i, "start"))
        for value, low, high in zip(robot.start, lower, upper, strict=True):
            if not low <= value <= high:
                reason = (
                    f"got {_show(robot.start)} outside the workspace; allowed: {_show(lower)} to {_show(upper)} [m]"
                )
                raise error(reason, _at(i, "start"))
        _check_outside_obstacles(mission, robot.start, _at(i, "start"), error)
    starts = [robot.start for robot in mission.robots]
    _check_apart(mission, starts, mission.limits.separation, "start", error)


def _check_pads(mission: Mission, frame: Airframe, error: ErrorAt) -> None:
    """Pads: inside the geofence, clear of obstacles, and far enough apart for everybody to take off at once."""
    margin = mission.flight.geofence_margin
    corners = list(zip(mission.workspace.lower, mission.workspace.upper, strict=True))[:2]
    for i, robot in enumerate(mission.robots):
        if robot.pad is None:
            continue
        for value, (low, high) in zip(robot.pad, corners, strict=True):
            if not low - margin - _SLACK <= value <= high + margin + _SLACK:
                reason = (
                    f"got {_show(robot.pad)}; allowed: at most geofence_margin = {margin:g} m outside the workspace"
                )
                raise error(reason, _at(i, "pad"))
        _check_outside_obstacles(mission, robot.pad, _at(i, "pad"), error)
    pads = [robot.pad or robot.start[:2] for robot in mission.robots]
    _check_apart(mission, pads, max(mission.limits.separation, 2.0 * frame.radius), "pad", error)


def _check_outside_obstacles(mission: Mission, point: Vector, where: str, error: ErrorAt) -> None:
    for k, obstacle in enumerate(mission.obstacles):
        distance = math.dist(point[:2], obstacle.center)
        if distance < obstacle.radius - _SLACK:
            reason = (
                f"got {_show(point)} inside obstacles[{k}], {distance:.3g} m from its centre; "
                f"allowed: at least {obstacle.radius:g} [m]"
            )
            raise error(reason, where)


def _check_apart(mission: Mission, points: list[Vector], least: float, field: str, error: ErrorAt) -> None:
    for (i, a), (j, b) in itertools.combinations(enumerate(points), 2):
        if math.dist(a, b) < least - _SLACK:
            reason = (
                f"{field}s of {mission.robots[i].name} and {mission.robots[j].name} are {math.dist(a, b):.3g} m apart; "
                f"allowed: at least {least:g} [m]"
            )
            raise error(reason, _at(j, field))


def _check_parameters(mission: Mission, error: ErrorAt) -> None:
    for name in mission.flight.parameters:
        if not _PARAMETER.fullmatch(name):
            raise error("allowed: 'group.name' of an on-board parameter", f"flight.parameters.{name[:60]!r}")


def _at(index: int, field: str) -> str:
    return f"robots[{index}].{field}"


def _show(point: Vector) -> str:
    return f"({', '.join(f'{value:g}' for value in point)})"
