"""Checks of one drone on its pad: link, machine, position."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from deploy.preflight.records import PreflightCheck, Result, judge
from deploy.radio.link import LinkState
from deploy.radio.supervisor import Supervisor
from missions.decks import DECKS, DeckName
from missions.fleet import pad_of
from missions.schema import Mission
from planner.flightplan import FlightPlan

Vec3 = tuple[float, float, float]
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
# What may well be over in a second: worth another look before anybody is left behind.
PASSING = frozenset({"link latency", "link quality", "supervisor", "pose", "estimate agrees with pose", "estimator"})


@dataclass(frozen=True)
class DroneFacts:
    """What is known of one drone on its pad.

    Attributes:
        protocol: CRTP protocol version. firmware: version text. memory: trajectory memory [bytes], 0 if none.
        link: state of its link. supervisor: None if unknown. voltage: [V], NaN if unknown.
        pose: where motion capture sees it [m], None without one. pose_age: [s].
        estimate: where it believes to be [m]. tilt: from the vertical [rad], NaN if unknown.
        parameters: on-board parameters that were set and read back.
        decks: that it has found; None if the firmware knows of none.
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
    decks: tuple[DeckName, ...] | None = None
    deviation: float = math.nan


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
        *_deck_checks(plan.mission, drone),
        *_position_checks(drone, external),
        *_place_checks(plan.mission, drone, external),
    )


def failed_before(robot: str, reason: str) -> PreflightCheck:
    """The check of a drone that could not even be asked."""
    remedy = "switch it on, come closer, check uri and parameters"
    return PreflightCheck("connection", robot, "failure", reason, "connected and set up", remedy)


def _link_checks(drone: DroneFacts) -> list[PreflightCheck]:
    robot, link = drone.robot, drone.link
    checks = [judge("link", robot, not link.lost, link.lost or "up", "up", "restart the drone, come closer")]
    if not math.isnan(link.latency):
        slow = link.latency > LATENCY_WARNING
        result: Result = "failure" if link.latency > LATENCY_LIMIT else "warning" if slow else "pass"
        remedy = "fewer drones a radio, another channel" if slow else ""
        limit = f"<= {LATENCY_LIMIT if result == 'failure' else LATENCY_WARNING:.0f} ms"
        checks.append(PreflightCheck("link latency", robot, result, f"{link.latency:.0f} ms", limit, remedy))
    if not math.isnan(link.quality):
        good = link.quality >= QUALITY_LIMIT
        value, limit = f"{link.quality:.0f} %", f">= {QUALITY_LIMIT:.0f} %"
        checks.append(judge("link quality", robot, good, value, limit, "another channel, come closer"))
    checks.append(
        judge(
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
        judge(
            "battery",
            robot,
            known and drone.voltage >= least,
            f"{drone.voltage:.2f} V" if known else "unknown",
            f">= {least:.2f} V",
            "charge or swap the battery",
        ),
        judge(
            "supervisor",
            robot,
            usable,
            str(word) if word else "unknown",
            "can be armed or able to fly; not tumbled, locked or crashed",
            "put it upright; if locked, restart it",
        ),
        judge(
            "trajectory memory",
            robot,
            drone.memory >= size,
            f"{drone.memory} bytes",
            f">= {size} bytes",
            "update the firmware",
        ),
        judge(
            "parameters",
            robot,
            True,
            ", ".join(f"{name} = {value:g}" for name, value in drone.parameters.items()),
            "read back as set",
            "",
        ),
        judge(
            "level",
            robot,
            math.isnan(drone.tilt) or drone.tilt <= TILT_LIMIT,
            f"{math.degrees(drone.tilt):.0f}°",
            f"<= {math.degrees(TILT_LIMIT):.0f}°",
            "put it on a level pad",
        ),
    ]


def _deck_checks(mission: Mission, drone: DroneFacts) -> list[PreflightCheck]:
    """The decks that the mission says are on it; one that is not pushed home is not there."""
    wanted = next(robot.decks for robot in mission.robots if robot.name == drone.robot)
    if not wanted:
        return []
    good = set(wanted) <= set(drone.decks or ())
    remedy = "push the decks home and restart the drone, or change 'decks' in the mission"
    return [judge("decks", drone.robot, good, _found(drone), ", ".join(wanted), remedy)]


def _found(drone: DroneFacts) -> str:
    return "firmware knows of none" if drone.decks is None else ", ".join(drone.decks) or "none"


def _position_checks(drone: DroneFacts, external: bool) -> list[PreflightCheck]:
    """Something tells the drone where it is, and its filter believes it."""
    robot, checks = drone.robot, []
    if not external:
        # A warning only: somebody else's computer may send positions. Without any the estimator is not sure.
        result: Result = "pass" if any(DECKS[deck].positions for deck in drone.decks or ()) else "warning"
        remedy = "" if result == "pass" else "fly with --mocap, or mount a deck that knows where it is"
        able = ", ".join(deck for deck, kind in DECKS.items() if kind.positions)
        checks.append(PreflightCheck("positioning deck", robot, result, _found(drone), f"one of {able}", remedy))
    if not math.isnan(drone.deviation):
        checks.append(
            judge(
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
        checks.append(judge("pose", robot, fresh, seen, f"<= {POSE_AGE_LIMIT} s old", remedy))
    place = drone.pose if external else drone.estimate
    if external and drone.pose is not None:
        apart = math.dist(drone.pose, drone.estimate) if drone.estimate is not None else math.inf
        remedy = "check the rigid body and its orientation; is this URI this body?"
        value, limit = f"{apart * 100:.0f} cm" if apart < math.inf else "unknown", f"<= {AGREEMENT_LIMIT * 100:.0f} cm"
        checks.append(judge("estimate agrees with pose", robot, apart <= AGREEMENT_LIMIT, value, limit, remedy))
    if place is not None:
        checks.append(_pad_check(mission, robot, place))
    return checks


def _pad_check(mission: Mission, robot: str, place: Vec3) -> PreflightCheck:
    pads = {other.name: pad_of(other) for other in mission.robots}
    away = math.dist(place[:2], pads[robot])
    owners = [name for name, pad in pads.items() if math.dist(place[:2], pad) <= PAD_LIMIT]
    remedy = f"put it at ({', '.join(f'{v:.2f}' for v in pads[robot])}) m"
    if owners and robot not in owners:
        remedy = f"it stands on the pad of {owners[0]}: swap the drones, their bodies' names or their URIs"
    limit = f"<= {PAD_LIMIT * 100:.0f} cm"
    return judge("on its pad", robot, away <= PAD_LIMIT, f"{away * 100:.0f} cm away", limit, remedy)
