"""Stage 4b of 7: prove what the bytes will do.

Sees the mission and the encoded bytes, nothing of the plan they came from: neither solver nor fit. Extrema are found
in continuous time with proven bounds (0.1 mm, 0.1 mm/s, 0.1 mm/s²); a check's value is the bound, never a sample.
Every check names the mission's own limit and, apart from it, the tolerance that numerics get.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from missions import fleet
from missions.schema import Mission
from planner.certificate import motion, places
from planner.certificate.airframe import airframe_checks
from planner.certificate.checks import check, value_of, worst
from planner.certificate.connectivity import connection_checks, gather, period_boundaries
from planner.certificate.errors import CertificateError
from planner.certificate.firmware import firmware_checks
from planner.certificate.memory import decoded, memory_checks
from planner.certificate.radio import radio_checks
from planner.certificate.record import Certificate, Check
from planner.certificate.separation import closest_approaches
from planner.certificate.switching import switching_checks
from planner.certificate.transitions import transition_checks
from planner.trajectory.encoded import EncodedTrajectory
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.transfers import Transfers

SHARE_TOLERANCE = 0.01  # of speed and acceleration limits
JUMP_LIMITS = (1e-3, 0.01, 0.1)  # [m], [m/s], [m/s²] at joints: what rounding may leave, far below what is felt
YAW_JUMP_LIMIT = 0.01  # [rad]
REST_LIMITS = (0.005, 0.05)  # [m/s], [m/s²] at both ends


def certify(
    mission: Mission, trajectories: Mapping[str, EncodedTrajectory], transfers: Transfers | None = None
) -> Certificate:
    """Check the bytes against the mission.

    Args:
        mission: what is allowed.
        trajectories: the bytes by robot name: exactly the mission's robots.
        transfers: the moves before and after; without them only the search is certified, which cannot be flown.

    Returns:
        The certificate; ``passed`` says whether nothing fails.

    Raises:
        CertificateError: the robots are not the mission's, or move in more than one way at once.
        TrajectoryError: a robot's bytes are no trajectory.
    """
    names = [robot.name for robot in mission.robots]
    if sorted(trajectories) != sorted(names):
        raise CertificateError(f"trajectories of {sorted(trajectories)}; the mission flies {sorted(names)}")
    flown = {name: decoded(name, trajectories[name]) for name in names}
    periods = period_boundaries(mission)
    paths = list(flown.values())
    approaches = closest_approaches(paths, periods)
    apart = places.with_downwash(mission, paths, approaches)
    evidence = gather(mission, paths, approaches)
    checks = [
        *places.separation(mission, apart),
        *worst(item for k, name in enumerate(names) for item in _robot_checks(mission, k, flown[name])),
        *connection_checks(mission, evidence),
        *(transition_checks(mission, transfers, flown) if transfers else ()),
        *worst(item for name in names for item in _memory(mission, name, trajectories[name], flown[name])),
        *radio_checks(mission, trajectories),
        *switching_checks(mission, trajectories, flown, apart),
    ]
    return Certificate(
        checks=tuple(checks),
        indicators=replace(evidence.found, smallest_clearance=value_of(checks, "obstacles")),
        mission_sha256=mission.source.sha256 if mission.source else "",
        trajectories_sha256=tuple((name, trajectories[name].sha256) for name in names),
        transfers_sha256=transfers.sha256 if transfers else "",
    )


def verify(
    certificate: Certificate,
    trajectories: Mapping[str, EncodedTrajectory],
    mission: Mission | None = None,
    transfers: Transfers | None = None,
) -> None:
    """Refuse trajectories (and a mission and moves, if given) this certificate was not made for.

    Says nothing about whether the certificate passed.

    Raises:
        CertificateError: a robot more or less, a changed byte, another move, another mission.
    """
    certified = dict(certificate.trajectories_sha256)
    if certified.keys() != trajectories.keys():
        raise CertificateError(f"the certificate is for {sorted(certified)}; got {sorted(trajectories)}")
    changed = [name for name, encoded in trajectories.items() if encoded.sha256 != certified[name]]
    if changed:
        raise CertificateError(f"the bytes of {', '.join(changed)} are not those that were certified")
    if transfers is not None and transfers.sha256 != certificate.transfers_sha256:
        raise CertificateError("the moves to the search and back are not those that were certified")
    if mission is not None and (mission.source.sha256 if mission.source else "") != certificate.mission_sha256:
        raise CertificateError(f"the certificate was made for another mission than this version of {mission.name!r}")


# ------------------------------------------------------------------------------------------------ the checks


def _robot_checks(mission: Mission, robot: int, flown: PiecewisePolynomial) -> list[Check]:
    """Everything about one robot in the air."""
    return [
        *places.of_robot(mission, robot, flown),
        *_envelope_checks(mission, robot, flown),
        *airframe_checks(mission, robot, flown),
        *_smoothness_checks(mission.robots[robot].name, flown),
    ]


def _envelope_checks(mission: Mission, robot: int, flown: PiecewisePolynomial) -> list[Check]:
    name = mission.robots[robot].name
    v_max, u_max = float(fleet.speeds(mission)[robot]), float(fleet.accelerations(mission)[robot])
    speed, acceleration = motion.largest_speed(flown), motion.largest_acceleration(flown)
    return [
        check("speed", speed.value, v_max, "m/s", "<=", name, speed.time, SHARE_TOLERANCE * v_max),
        check(
            "acceleration", acceleration.value, u_max, "m/s²", "<=", name, acceleration.time, SHARE_TOLERANCE * u_max
        ),
    ]


def _smoothness_checks(name: str, flown: PiecewisePolynomial) -> list[Check]:
    checks = []
    quantities = ("position", "velocity", "acceleration")
    for order, (quantity, unit) in enumerate(zip(quantities, ("m", "m/s", "m/s²"), strict=True)):
        jump = motion.largest_jump(flown, order)
        checks.append(check(f"{quantity} jump", jump.value, JUMP_LIMITS[order], unit, "<=", name, jump.time))
    jump = motion.largest_jump(flown, 0, slice(3, 4))
    checks.append(check("yaw jump", jump.value, YAW_JUMP_LIMIT, "rad", "<=", name, jump.time))
    for order, unit in ((1, "m/s"), (2, "m/s²")):
        rest = motion.largest_at_ends(flown, order)
        checks.append(
            check(f"{quantities[order]} at rest", rest.value, REST_LIMITS[order - 1], unit, "<=", name, rest.time)
        )
    return checks


def _memory(mission: Mission, name: str, encoded: EncodedTrajectory, flown: PiecewisePolynomial) -> list[Check]:
    return [*memory_checks(name, encoded, flown.duration, mission.horizon.duration), *firmware_checks(name, flown)]
