"""Whether the drone can do what the bytes ask: motors, tilt, rates; and whether its controller will follow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from missions.airframes import GRAVITY, Airframe, airframe
from missions.schema import FixedYaw, Mission
from planner.certificate import motion
from planner.certificate.checks import check
from planner.certificate.flatness import Demands, demands
from planner.certificate.record import Check
from planner.trajectory.piecewise import PiecewisePolynomial

RATE_TOLERANCE = 0.01  # share of the limit
YAW_TOLERANCE = 0.01  # [rad]; the compressed format rounds to 0.1 degrees
LEAST_WEIGHT = 0.5  # share of the weight; with less for 1 s the firmware takes it for tumbled (supervisor.c)
# The PID controller clips what it asks for; limits are its parameters, these their defaults (platform_defaults_cf2.h).
PID_LIMITS: Mapping[str, float] = {
    "posCtlPid.xVelMax": 1.0,  # [m/s]
    "posCtlPid.yVelMax": 1.0,
    "posCtlPid.zVelMax": 1.0,
    "posCtlPid.rLimit": 20.0,  # [degrees]
    "posCtlPid.pLimit": 20.0,
}
_DEGREE = 0.017453292519943295  # [rad]


def airframe_checks(mission: Mission, robot: int, flown: PiecewisePolynomial) -> list[Check]:
    """Everything about one robot that depends on what it is made of.

    Args:
        mission: names the airframe and the controller.
        robot: its index.
        flown: its decoded trajectory.
    """
    name, frame = mission.robots[robot].name, airframe(mission.flight.airframe)
    asked = demands(flown, frame)
    checks = [*_motor_checks(name, frame, asked), *_yaw_checks(mission, name, frame, flown, asked)]
    if mission.flight.controller == "pid":
        checks += _pid_checks(name, mission.flight.parameters, flown, asked)
    return checks


def _motor_checks(name: str, frame: Airframe, asked: Demands) -> list[Check]:
    weight = frame.mass * GRAVITY
    rows: tuple[tuple[str, motion.Worst, float, str, Literal["<=", ">="]], ...] = (
        ("thrust", asked.thrust, 4.0 * frame.motor_thrust_max, "N", "<="),
        ("least thrust", asked.least_thrust, LEAST_WEIGHT * weight, "N", ">="),
        ("motor thrust", asked.motor, frame.motor_thrust_max, "N", "<="),
        ("least motor thrust", asked.least_motor, 0.0, "N", ">="),
        ("tilt", asked.tilt, frame.hover_tilt, "rad", "<="),
        ("roll and pitch rate", asked.rate, min(frame.rate_limit[:2]), "rad/s", "<="),
    )
    return [check(kind, worst.value, limit, unit, sign, name, worst.time) for kind, worst, limit, unit, sign in rows]


def _yaw_checks(
    mission: Mission, name: str, frame: Airframe, flown: PiecewisePolynomial, asked: Demands
) -> list[Check]:
    """How fast the robot turns; where it looks, if that is always the same way."""
    wanted, rate = mission.trajectory.yaw, asked.yaw_rate
    limit = min(mission.trajectory.yaw_rate, frame.rate_limit[2])
    checks = [check("yaw rate", rate.value, limit, "rad/s", "<=", name, rate.time, RATE_TOLERANCE * limit)]
    if isinstance(wanted, FixedYaw):
        error = motion.largest_offset(flown, 3, wanted.angle)
        checks.append(check("yaw", error.value, 0.0, "rad", "<=", name, error.time, YAW_TOLERANCE))
    return checks


def _pid_checks(name: str, parameters: Mapping[str, float], flown: PiecewisePolynomial, asked: Demands) -> list[Check]:
    """Advice: beyond these the position controller saturates and falls behind.

    It clips along the axes of its heading; the horizontal speed bounds both whatever the heading is.
    """
    limits = {key: parameters.get(key, default) for key, default in PID_LIMITS.items()}
    aside, up = motion.largest_speed(flown, slice(0, 2)), motion.largest_speed(flown, slice(2, 3))
    level = min(limits["posCtlPid.xVelMax"], limits["posCtlPid.yVelMax"])
    tilt = _DEGREE * min(limits["posCtlPid.rLimit"], limits["posCtlPid.pLimit"])
    rows = (
        ("PID horizontal speed", aside, level, "m/s"),
        ("PID vertical speed", up, limits["posCtlPid.zVelMax"], "m/s"),
        ("PID tilt", asked.tilt, tilt, "rad"),
    )
    return [
        check(kind, worst.value, limit, unit, "<=", name, worst.time, severity="warning")
        for kind, worst, limit, unit in rows
    ]
