"""Pre-flight checks: each with a name, what was found, what is allowed and what to do about it; no I/O.

All drones are checked before anybody is told, and every failure is listed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from deploy.errors import PreflightError
from deploy.radio.drone import LinkState
from deploy.radio.supervisor import Supervisor
from missions.schema import Mission
from planner.certificate.certify import certify, verify
from planner.certificate.compare import differences
from planner.certificate.errors import CertificateError
from planner.errors import PlannerError
from planner.flightplan import FlightPlan

Vec3 = tuple[float, float, float]
Result = Literal["pass", "warning", "failure"]
# ms. Downlink packets ride on acknowledgements, so the telemetry of the four or five drones a dongle carries takes
# 20 to 40 ms to arrive; what is slower than that is interference or too many drones.
LATENCY_WARNING, LATENCY_LIMIT = 50.0, 250.0
QUALITY_LIMIT = 80.0  # %
PROTOCOL_LIMIT = 10  # go_to_2 and start_trajectory_2
POSE_AGE_LIMIT = 0.2  # s
AGREEMENT_LIMIT = 0.05  # m
PAD_LIMIT = 0.15  # m
TILT_LIMIT = math.radians(15.0)
SETTLED_DEVIATION = 0.05  # m: how far the filter may be off by its own account, one standard deviation
DISK_LIMIT = 200.0  # MB; half an hour of ten drones takes about as much
# What may well be over in a second: worth another look before anybody is left behind.
PASSING = frozenset({"link latency", "link quality", "supervisor", "pose", "estimate agrees with pose", "estimator"})


@dataclass(frozen=True)
class PreflightCheck:
    """One line of the pre-flight table.

    Attributes:
        name: what was checked. robot: on whom; empty for the whole flight.
        result: a failure keeps everybody on the ground.
        value: what was found. limit: what is allowed.
        remedy: what to do if it did not pass.
    """

    name: str
    robot: str
    result: Result
    value: str
    limit: str
    remedy: str = ""

    @property
    def text(self) -> str:
        """All but the robot, in one line."""
        return f"{self.name}: {self.value} (allowed: {self.limit})" + (f"; {self.remedy}" if self.remedy else "")

    def __str__(self) -> str:
        return f"{self.robot}: {self.text}" if self.robot else self.text


@dataclass(frozen=True)
class PreflightReport:
    """Every check that was made."""

    checks: tuple[PreflightCheck, ...] = ()

    @property
    def failures(self) -> tuple[PreflightCheck, ...]:
        """Those that keep the swarm on the ground."""
        return tuple(check for check in self.checks if check.result == "failure")

    def require(self) -> None:
        """Raise PreflightError, which carries all checks, unless there is no failure."""
        if self.failures:
            listing = "; ".join(str(check) for check in self.failures)
            raise PreflightError(f"{len(self.failures)} pre-flight checks failed: {listing}", self.checks)


@dataclass(frozen=True)
class DroneFacts:
    """What is known of one drone on its pad.

    Attributes:
        protocol: CRTP protocol version. firmware: version text. memory: trajectory memory [bytes], 0 if none.
        link: state of its link. supervisor: None if unknown. voltage: [V], NaN if unknown.
        pose: where motion capture sees it [m], None without one. pose_age: [s].
        estimate: where it believes to be [m]. tilt: from the vertical [rad], NaN if unknown.
        parameters: on-board parameters that were set and read back.
        decks: positioning decks; None if the firmware knows of none.
        deviation: of the estimated position by the filter's own account [m]; NaN if unknown.
    """

    robot: str
    protocol: int
    firmware: str
    memory: int
    link: LinkState
    supervisor: Supervisor | None
    voltage: float
    pose: Vec3 | None
    pose_age: float
    estimate: Vec3 | None
    tilt: float
    parameters: Mapping[str, float]
    decks: tuple[str, ...] | None = None
    deviation: float = math.nan


def check_plan(plan: FlightPlan) -> tuple[PreflightCheck, ...]:
    """The certificate passes, belongs to these very bytes and this mission, and is what they certify to, once more."""
    certificate = plan.certificate
    text = ", ".join(f"{check.name} {check.where}".strip() for check in certificate.failures) or (
        "passed" if certificate.passed else "nothing was checked"
    )
    passed = _judge("certificate", "", certificate.passed, text, "every check passed", "plan the mission again")
    try:
        verify(plan.certificate, plan.trajectories, plan.mission, plan.transfers)
        found = "these bytes, this mission" if plan.transfers else "a search without a way to it and back"
    except CertificateError as error:
        found = str(error)
    bound = _judge(
        "certificate is for",
        "",
        found.startswith("these"),
        found,
        "these bytes, this mission",
        "do not edit plan files; plan again",
    )
    return passed, bound, _repeated(plan)


def _repeated(plan: FlightPlan) -> PreflightCheck:
    """A file's hashes can be made to fit whatever was edited into it; the proof cannot."""
    try:
        differing = differences(plan.certificate, certify(plan.mission, plan.trajectories, plan.transfers))
        found = f"another result for {', '.join(differing)}" if differing else "the same"
    except PlannerError as error:
        differing, found = ("everything",), str(error)
    remedy = "do not edit plan files; plan again with this version"
    return _judge("certificate, computed again", "", not differing, found, "the same", remedy)


def check_log(failure: str, free: float) -> tuple[PreflightCheck, ...]:
    """The flight log is being written, and has room.

    Args:
        failure: why it is not being written; empty if it is.
        free: room on its disk [MB].
    """
    remedy = "free disk space, or log elsewhere"
    return (
        _judge("flight log", "", not failure, failure or "open", "open", remedy),
        _judge("disk", "", free >= DISK_LIMIT, f"{free:.0f} MB", f">= {DISK_LIMIT:.0f} MB", remedy),
    )


def check_limits(plan: FlightPlan) -> tuple[PreflightCheck, ...]:
    """What the certificate has proven of the geofence and the radio, by name; without it there is no such check."""
    inside = [c for c in plan.certificate.checks if c.name == "workspace" or c.name.endswith("geofence")]
    load = [c for c in plan.certificate.checks if c.name == "radio load"]
    checks = []
    if inside:
        least = min(inside, key=lambda check: check.value - check.limit)
        found = f"{least.value:.2f} {least.unit} inside ({least.name}, {least.where})"
        limit, remedy = f">= {least.limit:g} {least.unit}", "a larger flight.geofence_margin, or plan again"
        checks.append(_judge("geofence contains the flight", "", all(c.passed for c in inside), found, limit, remedy))
    for check in load:
        result: Result = "pass" if check.passed else "warning"
        remedy = "" if check.passed else "fewer drones a dongle, lower flight.pose_rate or log_rate"
        value, limit = f"{check.value:.0f} {check.unit} ({check.where})", f"<= {check.limit:.0f} {check.unit}"
        checks.append(PreflightCheck("radio budget", "", result, value, limit, remedy))
    return tuple(checks)


def check_drone(plan: FlightPlan, drone: DroneFacts, external: bool) -> tuple[PreflightCheck, ...]:
    """All checks of one drone.

    Args:
        plan: what shall fly.
        drone: what is known of it.
        external: whether motion capture positions the drones.
    """
    return (
        *_link_checks(drone),
        *_machine_checks(plan, drone),
        *_position_checks(drone, external),
        *_place_checks(plan.mission, drone, external),
    )


def failed_before(robot: str, reason: str) -> PreflightCheck:
    """The check of a drone that could not even be asked."""
    remedy = "switch it on, come closer, check uri and parameters"
    return PreflightCheck("connection", robot, "failure", reason, "connected and set up", remedy)


def check_left(left: int, fewest: int, failing: str) -> PreflightCheck:
    """Why nobody is left behind: too few others, or what of their certificate fails (empty: too few)."""
    if failing:
        remedy = "make everybody fit, or plan without them"
        return PreflightCheck("certificate of the others", "", "failure", failing, "every check passed", remedy)
    return PreflightCheck("robots left", "", "failure", str(left), f">= {fewest} (safety.min_robots)", "make them fit")


def check_same(firmware: Mapping[str, str]) -> PreflightCheck:
    """Everybody flies the same firmware.

    Args:
        firmware: version by robot.
    """
    versions = sorted(set(firmware.values()))
    same: Result = "pass" if len(versions) <= 1 else "warning"
    remedy = "" if same == "pass" else "flash all drones with the same release"
    return PreflightCheck("same firmware", "", same, ", ".join(versions) or "unknown", "one version", remedy)


def pad_of(mission: Mission, robot: str) -> tuple[float, float]:
    """(x, y) of a robot's pad [m]: under its start unless the mission says otherwise."""
    record = next(item for item in mission.robots if item.name == robot)
    place = record.pad or record.start
    return float(place[0]), float(place[1])


def _judge(name: str, robot: str, good: bool, value: str, limit: str, remedy: str) -> PreflightCheck:
    return PreflightCheck(name, robot, "pass" if good else "failure", value, limit, "" if good else remedy)


def _link_checks(drone: DroneFacts) -> list[PreflightCheck]:
    robot, link = drone.robot, drone.link
    checks = [_judge("link", robot, not link.lost, link.lost or "up", "up", "restart the drone, come closer")]
    if not math.isnan(link.latency):
        slow = link.latency > LATENCY_WARNING
        result: Result = "failure" if link.latency > LATENCY_LIMIT else "warning" if slow else "pass"
        remedy = "fewer drones a radio, another channel" if slow else ""
        limit = f"<= {LATENCY_LIMIT if result == 'failure' else LATENCY_WARNING:.0f} ms"
        checks.append(PreflightCheck("link latency", robot, result, f"{link.latency:.0f} ms", limit, remedy))
    if not math.isnan(link.quality):
        good = link.quality >= QUALITY_LIMIT
        value, limit = f"{link.quality:.0f} %", f">= {QUALITY_LIMIT:.0f} %"
        checks.append(_judge("link quality", robot, good, value, limit, "another channel, come closer"))
    checks.append(
        _judge(
            "protocol",
            robot,
            drone.protocol >= PROTOCOL_LIMIT,
            f"version {drone.protocol}",
            f">= {PROTOCOL_LIMIT}",
            "update the firmware",
        )
    )
    return checks


def _machine_checks(plan: FlightPlan, drone: DroneFacts) -> list[PreflightCheck]:
    robot, word, least = drone.robot, drone.supervisor, plan.mission.flight.battery_minimum
    size = plan.trajectories[robot].memory
    known = not math.isnan(drone.voltage)
    usable = word is not None and not word.fault and (word.ready or word.bits & 1 == 1)
    return [
        _judge(
            "battery",
            robot,
            known and drone.voltage >= least,
            f"{drone.voltage:.2f} V" if known else "unknown",
            f">= {least:.2f} V",
            "charge or swap the battery",
        ),
        _judge(
            "supervisor",
            robot,
            usable,
            str(word) if word else "unknown",
            "can be armed or able to fly; not tumbled, locked or crashed",
            "put it upright; if locked, restart it",
        ),
        _judge(
            "trajectory memory",
            robot,
            drone.memory >= size,
            f"{drone.memory} bytes",
            f">= {size} bytes",
            "update the firmware",
        ),
        _judge(
            "parameters",
            robot,
            True,
            ", ".join(f"{name} = {value:g}" for name, value in drone.parameters.items()),
            "read back as set",
            "",
        ),
        _judge(
            "level",
            robot,
            math.isnan(drone.tilt) or drone.tilt <= TILT_LIMIT,
            f"{math.degrees(drone.tilt):.0f}°",
            f"<= {math.degrees(TILT_LIMIT):.0f}°",
            "put it on a level pad",
        ),
    ]


def _position_checks(drone: DroneFacts, external: bool) -> list[PreflightCheck]:
    """Something tells the drone where it is, and its filter believes it."""
    robot, checks = drone.robot, []
    if not external:
        decks = "firmware knows of none" if drone.decks is None else ", ".join(drone.decks) or "none"
        # A warning only: somebody else's computer may send positions. Without any the estimator is not sure.
        result: Result = "pass" if drone.decks else "warning"
        remedy = "" if drone.decks else "fly with --mocap, or mount a deck that knows where it is"
        checks.append(PreflightCheck("positioning deck", robot, result, decks, "one that tells positions", remedy))
    if not math.isnan(drone.deviation):
        checks.append(
            _judge(
                "estimator",
                robot,
                drone.deviation <= SETTLED_DEVIATION,
                f"sure to {drone.deviation * 100:.1f} cm",
                f"<= {SETTLED_DEVIATION * 100:.0f} cm",
                "is its position sent, or its deck in view of base stations or anchors?",
            )
        )
    return checks


def _place_checks(mission: Mission, drone: DroneFacts, external: bool) -> list[PreflightCheck]:
    robot = drone.robot
    checks = []
    if external:
        fresh = drone.pose is not None and drone.pose_age <= POSE_AGE_LIMIT
        seen = f"{drone.pose_age:.2f} s old" if drone.pose is not None else "never seen"
        remedy = "check the rigid body's name and markers"
        checks.append(_judge("pose", robot, fresh, seen, f"<= {POSE_AGE_LIMIT} s old", remedy))
    place = drone.pose if external else drone.estimate
    if external and drone.pose is not None:
        apart = math.dist(drone.pose, drone.estimate) if drone.estimate is not None else math.inf
        remedy = "check the rigid body and its orientation; is this URI this body?"
        value, limit = f"{apart * 100:.0f} cm" if apart < math.inf else "unknown", f"<= {AGREEMENT_LIMIT * 100:.0f} cm"
        checks.append(_judge("estimate agrees with pose", robot, apart <= AGREEMENT_LIMIT, value, limit, remedy))
    if place is not None:
        checks.append(_pad_check(mission, robot, place))
    return checks


def _pad_check(mission: Mission, robot: str, place: Vec3) -> PreflightCheck:
    away = math.dist(place[:2], pad_of(mission, robot))
    owners = [other.name for other in mission.robots if math.dist(place[:2], pad_of(mission, other.name)) <= PAD_LIMIT]
    remedy = f"put it at ({', '.join(f'{v:.2f}' for v in pad_of(mission, robot))}) m"
    if owners and robot not in owners:
        remedy = f"it stands on the pad of {owners[0]}: swap the drones, their bodies' names or their URIs"
    limit = f"<= {PAD_LIMIT * 100:.0f} cm"
    return _judge("on its pad", robot, away <= PAD_LIMIT, f"{away * 100:.0f} cm away", limit, remedy)
