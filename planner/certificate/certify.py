"""Stage 4b of 7: prove what the bytes will do.

Sees the mission and the encoded bytes, nothing of the plan they came from: neither solver nor fit. Extrema are found
in continuous time with proven bounds (0.1 mm, 0.1 mm/s, 0.1 mm/s²); a check's value is the bound, never a sample.
Every check names the mission's own limit and, apart from it, the tolerance that numerics get.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Literal

import numpy as np

from missions.arrays import Array
from missions.schema import Mission, ProbabilisticConnectivity
from planner.certificate import motion, obstacles, transitions, workspace
from planner.certificate.connectivity import period_boundaries, with_exact_meetings
from planner.certificate.errors import CertificateError
from planner.certificate.memory import decoded, memory_checks
from planner.certificate.record import Certificate, Check, Indicators
from planner.certificate.separation import Approaches, closest_approaches
from planner.indicators import indicators
from planner.trajectory.encoded import EncodedTrajectory
from planner.trajectory.piecewise import PiecewisePolynomial

DISTANCE_TOLERANCE = 1e-3  # [m]
SHARE_TOLERANCE = 0.01  # of speed and acceleration limits
PROBABILITY_TOLERANCE = 1e-6
JUMP_LIMITS = (1e-3, 0.01, 0.1)  # [m], [m/s], [m/s²] at joints: what rounding may leave, far below what is felt
YAW_JUMP_LIMIT = 0.01  # [rad]
REST_LIMITS = (0.005, 0.05)  # [m/s], [m/s²] at both ends

_SAMPLES_PER_STEP = 4  # for shares of time, the only sampled figures


def certify(mission: Mission, trajectories: Mapping[str, EncodedTrajectory]) -> Certificate:
    """Check the bytes against the mission.

    Args:
        mission: what is allowed.
        trajectories: the bytes by robot name: exactly the mission's robots.

    Returns:
        The certificate; ``passed`` says whether every check did.

    Raises:
        CertificateError: the robots are not the mission's.
        TrajectoryError: a robot's bytes are no trajectory.
    """
    names = [robot.name for robot in mission.robots]
    if sorted(trajectories) != sorted(names):
        raise CertificateError(f"trajectories of {sorted(trajectories)}; the mission flies {sorted(names)}")
    flown = {name: decoded(name, trajectories[name]) for name in names}
    periods = period_boundaries(mission)
    approaches = closest_approaches(list(flown.values()), periods)
    found = _indicators(mission, flown, approaches)
    checks = [
        *(_separation(mission, names, approaches)),
        *(_worst(check for name in names for check in _robot_checks(mission, name, flown[name]))),
        *(_connection_checks(mission, names, found, approaches)),
        *(_transition_checks(mission, names, flown)),
        *(_worst(check for name in names for check in _memory(mission, name, trajectories[name], flown[name]))),
    ]
    return Certificate(
        checks=tuple(checks),
        indicators=replace(found, smallest_clearance=_value_of(checks, "obstacles")),
        mission_sha256=mission.source.sha256 if mission.source else "",
        trajectories_sha256=tuple((name, trajectories[name].sha256) for name in names),
    )


def verify(
    certificate: Certificate, trajectories: Mapping[str, EncodedTrajectory], mission: Mission | None = None
) -> None:
    """Refuse trajectories (and a mission, if given) this certificate was not made for.

    Says nothing about whether the certificate passed.

    Raises:
        CertificateError: a robot more or less, a changed byte, another mission.
    """
    certified = dict(certificate.trajectories_sha256)
    if certified.keys() != trajectories.keys():
        raise CertificateError(f"the certificate is for {sorted(certified)}; got {sorted(trajectories)}")
    changed = [name for name, encoded in trajectories.items() if encoded.sha256 != certified[name]]
    if changed:
        raise CertificateError(f"the bytes of {', '.join(changed)} are not those that were certified")
    if mission is not None and (mission.source.sha256 if mission.source else "") != certificate.mission_sha256:
        raise CertificateError(f"the certificate was made for another mission than this version of {mission.name!r}")


# ------------------------------------------------------------------------------------------------ the checks


def _check(
    name: str,
    value: float,
    limit: float,
    unit: str,
    relation: Literal["<=", ">="],
    where: str = "",
    time: float | None = None,
    tolerance: float = 0.0,
) -> Check:
    """A check that passes if value stands to limit as it should, up to the tolerance."""
    passed = value <= limit + tolerance if relation == "<=" else value >= limit - tolerance
    return Check(name, float(value), float(limit), unit, relation, bool(passed), where, time, tolerance)


def _separation(mission: Mission, names: list[str], approaches: Approaches) -> list[Check]:
    if not approaches.pairs:
        return []
    pair, period = np.unravel_index(np.argmin(approaches.bound), approaches.bound.shape)
    return [
        _check(
            "separation",
            approaches.bound[pair, period],
            mission.limits.separation,
            "m",
            ">=",
            transitions.names_of(approaches.pairs[pair], names),
            float(approaches.time[pair, period]),
            DISTANCE_TOLERANCE,
        )
    ]


def _robot_checks(mission: Mission, name: str, flown: PiecewisePolynomial) -> list[Check]:
    """Everything about one robot in the air."""
    return [
        *_place_checks(mission, name, flown),
        *_envelope_checks(mission, name, flown),
        *_smoothness_checks(name, flown),
    ]


def _place_checks(mission: Mission, name: str, flown: PiecewisePolynomial) -> list[Check]:
    checks = []
    for number, obstacle in enumerate(mission.obstacles):
        gap = obstacles.clearance(flown, obstacle)
        where = f"{name}, obstacles[{number}]"
        value, time = float(gap.bound[0]), float(gap.time[0])
        checks.append(_check("obstacles", value, 0.0, "m", ">=", where, time, DISTANCE_TOLERANCE))
    side = workspace.inside(flown, mission.workspace)
    value, time = float(side.bound[0]), float(side.time[0])
    checks.append(_check("workspace", value, 0.0, "m", ">=", name, time, DISTANCE_TOLERANCE))
    if mission.dimension == 2:
        value, time = workspace.altitude_error(flown, mission.flight.altitude)
        checks.append(_check("altitude", value, 0.0, "m", "<=", name, time, DISTANCE_TOLERANCE))
    robot = next(robot for robot in mission.robots if robot.name == name)
    offset = flown.evaluate(np.zeros(1))[0, : mission.dimension] - robot.start
    value = float(np.linalg.norm(offset))
    checks.append(_check("start point", value, 0.0, "m", "<=", name, 0.0, DISTANCE_TOLERANCE))
    return checks


def _envelope_checks(mission: Mission, name: str, flown: PiecewisePolynomial) -> list[Check]:
    limits = mission.limits
    speed, acceleration = motion.largest_speed(flown), motion.largest_acceleration(flown)
    return [
        _check("speed", speed.value, limits.speed, "m/s", "<=", name, speed.time, SHARE_TOLERANCE * limits.speed),
        _check(
            "acceleration",
            acceleration.value,
            limits.acceleration,
            "m/s²",
            "<=",
            name,
            acceleration.time,
            SHARE_TOLERANCE * limits.acceleration,
        ),
    ]


def _smoothness_checks(name: str, flown: PiecewisePolynomial) -> list[Check]:
    checks = []
    quantities = ("position", "velocity", "acceleration")
    for order, (quantity, unit) in enumerate(zip(quantities, ("m", "m/s", "m/s²"), strict=True)):
        jump = motion.largest_jump(flown, order)
        checks.append(_check(f"{quantity} jump", jump.value, JUMP_LIMITS[order], unit, "<=", name, jump.time))
    jump = motion.largest_jump(flown, 0, slice(3, 4))
    checks.append(_check("yaw jump", jump.value, YAW_JUMP_LIMIT, "rad", "<=", name, jump.time))
    for order, unit in ((1, "m/s"), (2, "m/s²")):
        rest = motion.largest_at_ends(flown, order)
        checks.append(
            _check(f"{quantities[order]} at rest", rest.value, REST_LIMITS[order - 1], unit, "<=", name, rest.time)
        )
    return checks


def _connection_checks(mission: Mission, names: list[str], found: Indicators, approaches: Approaches) -> list[Check]:
    """The policy: every pair's P in every sub-period, and that they truly meet in it."""
    policy = mission.connectivity
    if not isinstance(policy, ProbabilisticConnectivity) or not found.pairs:
        return []
    P = np.array([pair.probability for pair in found.pairs])
    pair, period = np.unravel_index(np.argmin(P), P.shape)
    where = f"{transitions.names_of(approaches.pairs[pair], names)}, sub-period {period + 1}"
    connection = _check(
        "connection probability", P[pair, period], policy.threshold, "", ">=", where, tolerance=PROBABILITY_TOLERANCE
    )
    pair, period = np.unravel_index(np.argmax(approaches.attained), approaches.attained.shape)
    where = f"{transitions.names_of(approaches.pairs[pair], names)}, sub-period {period + 1}"
    meeting = _check(
        "meeting",
        approaches.attained[pair, period],
        policy.range,
        "m",
        "<=",
        where,
        float(approaches.time[pair, period]),
        DISTANCE_TOLERANCE,
    )
    return [connection, meeting]


def _transition_checks(mission: Mission, names: list[str], flown: Mapping[str, PiecewisePolynomial]) -> list[Check]:
    """Take-off, transfer and landing: distances between columns and moves, and obstacles on the way."""
    pads, starts = transitions.pads(mission), transitions.starts(mission)
    ends = np.array([flown[name].evaluate(np.array([flown[name].duration]))[0, :2] for name in names])
    checks = []
    moves = {"take-off separation": (pads, pads), "transfer separation": (pads, starts)}
    moves["landing separation"] = (ends, ends)
    for name, (begin, end) in moves.items():
        distance, pair = transitions.smallest_distance(begin, end)
        if pair is not None:
            where = transitions.names_of(pair, names)
            limit = mission.limits.separation
            checks.append(_check(name, distance, limit, "m", ">=", where, tolerance=DISTANCE_TOLERANCE))
    clearances = [
        _check(
            "transfer obstacles",
            obstacles.segment_clearance(pads[robot], starts[robot], obstacle),
            0.0,
            "m",
            ">=",
            f"{name}, obstacles[{number}]",
            tolerance=DISTANCE_TOLERANCE,
        )
        for robot, name in enumerate(names)
        for number, obstacle in enumerate(mission.obstacles)
    ]
    return [*checks, *_worst(clearances)]


def _memory(mission: Mission, name: str, encoded: EncodedTrajectory, flown: PiecewisePolynomial) -> list[Check]:
    return memory_checks(name, encoded, flown.duration, mission.horizon.duration)


# ------------------------------------------------------------------------------------------------ figures


def _indicators(mission: Mission, flown: Mapping[str, PiecewisePolynomial], approaches: Approaches) -> Indicators:
    """Indicators of what will fly; meetings and distances exact, shares of time from samples."""
    t: Array = np.arange(mission.steps * _SAMPLES_PER_STEP, dtype=np.float64) * (mission.horizon.dt / _SAMPLES_PER_STEP)
    q = np.stack([trajectory.evaluate(t)[:, : mission.dimension] for trajectory in flown.values()], axis=1)
    return with_exact_meetings(mission, indicators(mission, t, q), approaches)


def _worst(checks: Iterable[Check]) -> list[Check]:
    """The worst check of each name, in the order of first appearance."""
    worst: dict[str, Check] = {}
    for check in checks:
        held = worst.get(check.name)
        if held is None or _badness(check) > _badness(held):
            worst[check.name] = check
    return list(worst.values())


def _badness(check: Check) -> float:
    """How far a value is on the wrong side of its limit, in the check's unit."""
    return check.value - check.limit if check.relation == "<=" else check.limit - check.value


def _value_of(checks: Iterable[Check], name: str) -> float:
    """Value of a check; inf if it was not made."""
    return next((check.value for check in checks if check.name == name), float("inf"))
