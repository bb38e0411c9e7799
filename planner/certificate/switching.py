"""Trajectories in legs: what it costs that a leg begins when its start command arrives, and whether it is there then.

A start command is sent ``radio.latency`` ahead and takes effect within ±J, J = ``radio.jitter``, of its time. From then
on the drone flies its leg shifted by as much, so a setpoint always lies on the certified path, at most J away in time:

- where two legs meet, the one before may be J late and the one after J early, or the other way round. The setpoint
  jumps ahead, or stands still at the end of the leg and then goes on: either way by no more than the way of 2J of
  flight, at most v·2J + ½a(2J)² from the speed v at the joint;
- obstacles are not affected, for they do not move; two robots may be closer by (v_i + v_j)·J than they are on time.

A leg is uploaded while the one before flies, into the half of the memory of the one before that, from when the start
of the one before is seen until ``READY_BEFORE`` its own; written and read back at the rate that poses, telemetry
and the other drones leave on the dongle, with half as much time again for repeats.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from missions.radio import request_rate
from missions.schema import Mission
from planner.certificate import motion
from planner.certificate.bernstein import derivative
from planner.certificate.checks import check, names_of, room, worst
from planner.certificate.radio import upload_requests
from planner.certificate.record import Check
from planner.certificate.separation import Approaches
from planner.trajectory.bezier import control_points
from planner.trajectory.encode import decode_leg
from planner.trajectory.encoded import EncodedTrajectory, Encoding
from planner.trajectory.legs import overlaps, switch_times
from planner.trajectory.piecewise import PiecewisePolynomial

READY_BEFORE = 0.5  # [s] before its start a leg is uploaded, or everybody lands while all still fly
SEEN_AFTER = 0.15  # [s] after its start a leg shows in the supervisor's word, which is formed 25 times a second
UPLOAD_SLACK = 1.5  # time that is kept for an upload, per time that it takes when nothing is lost
FASTEST_REQUESTS = 50.0  # [1/s] to one drone, whatever the radio carries: an answer takes a tick or two of the loop
TELEMETRY_WAIT = 2.0  # periods of telemetry until it is known that a leg flies, and the half it left may be written

_ALIGNMENT = 4  # bytes; the firmware reads Poly4D floats in place


@dataclass(frozen=True)
class Switch:
    """Where one leg of a robot follows another.

    Attributes:
        robot: its index. leg: number of the leg that begins, from 0. time: when [s since the start].
        speed: at the joint [m/s]. jump: bound of the setpoint's jump [m].
    """

    robot: int
    leg: int
    time: float
    speed: float
    jump: float


def switching_checks(
    mission: Mission,
    trajectories: Mapping[str, EncodedTrajectory],
    flown: Mapping[str, PiecewisePolynomial],
    approaches: Approaches,
) -> list[Check]:
    """The worst switch, the closest pair with its starts off, the tightest upload; nothing if everybody has one leg.

    Args:
        mission: what is allowed.
        trajectories: the bytes by robot name.
        flown: the polynomials they say.
        approaches: closest approaches of their pairs, with downwash.
    """
    if all(len(encoded.legs) == 1 for encoded in trajectories.values()):
        return []
    names = [robot.name for robot in mission.robots]
    limit = mission.radio.switch_jump
    jumps = (
        check("switch jump", item.jump, limit, "m", "<=", f"{names[item.robot]}, leg {item.leg + 1}", item.time)
        for item in switches(mission, trajectories)
    )
    memory = (item for name in names for item in _memory_checks(name, trajectories[name]))
    return [
        *worst(memory),
        *worst(jumps),
        *_separation(mission, flown, approaches),
        *worst(_uploads(mission, trajectories)),
    ]


def switches(mission: Mission, trajectories: Mapping[str, EncodedTrajectory]) -> list[Switch]:
    """Every switch of every robot, from the bytes."""
    delay, found = 2.0 * mission.radio.jitter, []
    for robot, item in enumerate(mission.robots):
        legs = [decode_leg(leg) for leg in trajectories[item.name].legs]
        if len(legs) == 1:
            continue
        acceleration = max(_bend(leg) for leg in legs)
        times = switch_times([leg.duration for leg in legs])
        for number, (before, leg) in enumerate(pairwise(legs), start=1):
            speed = max(_speed_at(before, end=True), _speed_at(leg, end=False))
            jump = speed * delay + 0.5 * acceleration * delay**2
            found.append(Switch(robot, number, times[number], speed, jump))
    return found


def allowed_speed(mission: Mission, switch: Switch) -> float:
    """Speed at which a switch would just keep ``radio.switch_jump`` [m/s], if the robot bends no more than it does."""
    delay = 2.0 * mission.radio.jitter
    return max(0.0, switch.speed - (switch.jump - mission.radio.switch_jump) / delay)


def seen_within(mission: Mission) -> float:
    """Time after a leg's start by which the drone's own word has told whether it flies [s]."""
    return SEEN_AFTER + TELEMETRY_WAIT / mission.flight.log_rate


def _memory_checks(name: str, encoded: EncodedTrajectory) -> Iterable[Check]:
    """That no leg lies where the one before it flies, and floats where the firmware may read them."""
    yield check("legs share memory", overlaps(encoded), 0.0, "bytes", "<=", name)
    off = max((leg.offset % _ALIGNMENT for leg in encoded.legs if leg.encoding is Encoding.POLY4D), default=0)
    yield check("leg alignment", off, 0.0, "bytes", "<=", name)


def _separation(mission: Mission, flown: Mapping[str, PiecewisePolynomial], approaches: Approaches) -> list[Check]:
    """The pair that may come closest when both are off time, one early and one late."""
    if not approaches.pairs or mission.limits.separation <= 0.0:
        return []
    names = [robot.name for robot in mission.robots]
    # Scaled vertical distances are shorter, hence scaled speeds lower: the bound holds for the ellipsoid, too.
    speed = [motion.largest_speed(flown[name]).value for name in names]
    lost = np.array([(speed[i] + speed[j]) * mission.radio.jitter for i, j in approaches.pairs])
    left = approaches.bound - lost[:, None]
    pair, period = np.unravel_index(np.argmin(left), left.shape)
    where, time = names_of(approaches.pairs[pair], names), float(approaches.time[pair, period])
    return [room("separation off time", float(left[pair, period]), where, time, mission.limits.separation)]


def _uploads(mission: Mission, trajectories: Mapping[str, EncodedTrajectory]) -> Iterable[Check]:
    """Time every upload in flight needs, against the time between the start of the leg before and its own."""
    seen = seen_within(mission)
    for robot, rate in zip(mission.robots, request_rate(mission), strict=True):
        legs = trajectories[robot.name].legs
        times = switch_times([decode_leg(leg).duration for leg in legs])
        for number in range(2, len(legs)):
            requests = upload_requests(EncodedTrajectory((legs[number],)))
            needed = UPLOAD_SLACK * requests / min(rate, FASTEST_REQUESTS) if rate > 0.0 else math.inf
            room = times[number] - times[number - 1] - seen - READY_BEFORE - 2.0 * mission.radio.jitter
            where = f"{robot.name}, leg {number + 1} of {len(legs)}"
            yield check("upload in flight", needed, room, "s", "<=", where, times[number - 1])


def _bend(leg: PiecewisePolynomial) -> float:
    """A bound of the acceleration's norm [m/s²]: no polynomial leaves the hull of its control points."""
    h = leg.durations
    points = derivative(derivative(control_points(leg.coefficients[:, :3], h), h), h)
    return float(np.linalg.norm(points, axis=1).max())


def _speed_at(leg: PiecewisePolynomial, *, end: bool) -> float:
    """Speed at the beginning or the end of a leg [m/s]."""
    velocity = derivative(control_points(leg.coefficients[:, :3], leg.durations), leg.durations)
    return float(np.linalg.norm(velocity[-1, :, -1] if end else velocity[0, :, 0]))
