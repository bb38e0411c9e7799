"""Log variables that live; the rest of the table of contents reads 0.

Values are computed when a started block asks for them, never before. Units are the firmware's (degrees, g, millimetres
in the compressed groups), pitch has its legacy sign.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from deploy.radio.simulated.decks import Deck
from deploy.radio.simulated.interface import PoseMeasurement, Setpoint, SetpointMode, Telemetry, Vec3
from deploy.radio.simulated.quaternion import compress, euler, to_body

_G = 9.81  # [m/s²]
_NOTHING = (0.0,) * 4
# Voltages [V] up to which the firmware says 0 %, 10 % … 90 % (pm_stm32f4.c, made for resting cells).
_CHARGE = (3.00, 3.78, 3.83, 3.87, 3.89, 3.92, 3.96, 4.00, 4.04, 4.10)
_LOW_POWER = 3
_PID, _MELLINGER = 1, 2
# Standard atmosphere at the floor: pressure [mbar], temperature [°C]; scale height [m] and exponent of the pressure.
_PRESSURE, _TEMPERATURE, _SCALE_HEIGHT, _EXPONENT = 1013.25, 25.0, 44330.0, 5.255
_RANGE_MAX, _NOTHING_SEEN = 4000.0, 32767.0  # [mm] of the ranger that looks down (vl53l1x)
_SENDING_POSES, _LIGHTHOUSE_MEMORY = 2, 0.5  # lighthouse.status; [s] without a measurement until it is 0
_STABILIZER_RATE = 1000.0  # [Hz]
_MODES = {
    SetpointMode.OFF: (0, 0, 0, 0, 0, 0),
    SetpointMode.FULL: (1, 1, 1, 0, 0, 1),
    SetpointMode.POSITION: (1, 1, 1, 0, 0, 1),
    SetpointMode.VELOCITY: (2, 2, 2, 0, 0, 2),
    SetpointMode.HOVER: (2, 2, 1, 0, 0, 2),
    SetpointMode.ATTITUDE: (0, 0, 0, 1, 1, 2),
    SetpointMode.HEIGHT: (0, 0, 1, 1, 1, 2),
    SetpointMode.CLIMB: (0, 0, 2, 1, 1, 2),
    SetpointMode.RATES: (0, 0, 0, 2, 2, 2),
}  # x, y, z, roll, pitch, yaw: 0 disabled, 1 absolute, 2 velocity

Getter = Callable[[], float]


@dataclass
class Snapshot:
    """What the drone knows at this tick; the firmware replaces the fields, the getters read them."""

    telemetry: Telemetry = field(default_factory=Telemetry)
    setpoint: Setpoint = field(default_factory=Setpoint)
    measurement: PoseMeasurement | None = None
    measured: float = -math.inf  # when a pose arrived last [s] since boot
    uptime: float = 0.0  # [s]
    controller: int = _PID
    info: int = 0
    battery_low: bool = False
    connected: bool = False
    tester_errors: int = 0
    packets_received: int = 0
    decks: tuple[Deck, ...] = ()


def live_variables(s: Snapshot) -> Mapping[str, Getter]:
    """Getters by full name."""
    getters: dict[str, Getter] = {}
    for part in (_estimate, _attitude, _sensors, _target, _control, _kalman, _decks, _system):
        getters.update(part(s))
    return getters


def _vector(group: str, names: str, read: Callable[[], tuple[float, ...]], scale: float = 1.0) -> dict[str, Getter]:
    """One getter per component of a vector; ``names`` separated by blanks."""

    def component(i: int) -> Getter:
        return (lambda: read()[i]) if scale == 1.0 else (lambda: read()[i] * scale)

    return {f"{group}.{name}": component(i) for i, name in enumerate(names.split())}


def _estimate(s: Snapshot) -> dict[str, Getter]:
    def body_rates_for_humans() -> tuple[float, ...]:
        roll, pitch, yaw = s.telemetry.gyro
        return (roll, -pitch, yaw)

    return {
        **_vector("stateEstimate", "x y z", lambda: s.telemetry.position),
        **_vector("stateEstimate", "vx vy vz", lambda: s.telemetry.velocity),
        **_vector("stateEstimate", "ax ay az", lambda: s.telemetry.acceleration, 1.0 / _G),
        **_vector("stateEstimate", "qx qy qz qw", lambda: s.telemetry.quaternion),
        **_vector("stateEstimateZ", "x y z", lambda: s.telemetry.position, 1e3),
        **_vector("stateEstimateZ", "vx vy vz", lambda: s.telemetry.velocity, 1e3),
        **_vector("stateEstimateZ", "ax ay az", lambda: s.telemetry.acceleration, 1e3),
        **_vector("stateEstimateZ", "rateRoll ratePitch rateYaw", body_rates_for_humans, 1e3),
        "stateEstimateZ.quat": lambda: compress(s.telemetry.quaternion),
    }


def _attitude(s: Snapshot) -> dict[str, Getter]:
    of, angles = Telemetry(), (0.0, 0.0, 0.0)

    def degrees() -> tuple[float, ...]:
        nonlocal of, angles
        if s.telemetry is not of:  # three variables of a block ask one after another
            of = s.telemetry
            roll, pitch, yaw = euler(of.quaternion)
            angles = (math.degrees(roll), -math.degrees(pitch), math.degrees(yaw))
        return angles

    getters: dict[str, Getter] = {}
    for group in ("stateEstimate", "stabilizer"):
        getters |= _vector(group, "roll pitch yaw", degrees)
    getters["stabilizer.thrust"] = lambda: s.telemetry.thrust
    getters["stabilizer.rtStab"] = lambda: _STABILIZER_RATE
    return getters


def _sensors(s: Snapshot) -> dict[str, Getter]:
    return {
        **_vector("gyro", "x y z", lambda: s.telemetry.gyro, 180.0 / math.pi),
        **_vector("acc", "x y z", lambda: s.telemetry.accelerometer),
        **_vector("motor", "m1 m2 m3 m4", lambda: s.telemetry.motors),
        **_vector("motor", "m1req m2req m3req m4req", lambda: s.telemetry.motors),
        "supervisor.accNorm": lambda: math.dist(s.telemetry.accelerometer, (0.0, 0.0, 0.0)),
        "baro.asl": lambda: s.telemetry.height,
        "baro.temp": lambda: _TEMPERATURE,
        "baro.pressure": lambda: _PRESSURE * (1.0 - s.telemetry.height / _SCALE_HEIGHT) ** _EXPONENT,
    }


def _target(s: Snapshot) -> dict[str, Getter]:
    def angles() -> tuple[float, ...]:
        roll, pitch = s.setpoint.attitude
        # The firmware's ctrltarget.yaw is the rate [°/s] (stabilizer.c: attitudeRate.yaw), and so it was recorded.
        return (math.degrees(roll), -math.degrees(pitch), math.degrees(s.setpoint.omega[2]))

    return {
        **_vector("ctrltarget", "x y z", lambda: s.setpoint.position),
        **_vector("ctrltarget", "vx vy vz", lambda: s.setpoint.velocity),
        **_vector("ctrltarget", "ax ay az", lambda: s.setpoint.acceleration),
        **_vector("ctrltarget", "roll pitch yaw", angles),
        **_vector("ctrltarget", "mode_x mode_y mode_z mode_roll mode_pitch mode_yaw", lambda: _MODES[s.setpoint.mode]),
        **_vector("ctrltargetZ", "x y z", lambda: s.setpoint.position, 1e3),
        **_vector("ctrltargetZ", "vx vy vz", lambda: s.setpoint.velocity, 1e3),
        **_vector("ctrltargetZ", "ax ay az", lambda: s.setpoint.acceleration, 1e3),
        "ctrltarget.thrust": lambda: s.setpoint.thrust,
    }


def _control(s: Snapshot) -> dict[str, Getter]:
    """What the controllers aim at and command; a controller that is not in charge says 0."""

    def firmware_signs(v: Vec3) -> Vec3:
        return (v[0], -v[1], v[2])

    def heading(v: Vec3) -> Vec3:
        """In the frame that is turned by the heading only."""
        yaw = euler(s.telemetry.quaternion)[2]
        c, n = math.cos(yaw), math.sin(yaw)
        return (c * v[0] + n * v[1], c * v[1] - n * v[0], v[2])

    def by(controller: int, read: Callable[[], tuple[float, ...]]) -> Callable[[], tuple[float, ...]]:
        return lambda: read() if s.controller == controller else _NOTHING

    def commanded() -> tuple[float, ...]:
        # The mixer's roll is right-handed, its pitch and yaw are not.
        roll, pitch, yaw = s.telemetry.moments
        return (s.telemetry.thrust, roll, -pitch, -yaw)

    def sensed() -> tuple[float, ...]:
        return (*firmware_signs(s.telemetry.gyro), s.telemetry.accelerometer[2])

    getters: dict[str, Getter] = {}
    for group, controller in (("controller", _PID), ("ctrlMel", _MELLINGER)):
        getters |= _vector(group, "cmd_thrust cmd_roll cmd_pitch cmd_yaw", by(controller, commanded))
        getters |= _vector(group, "r_roll r_pitch r_yaw accelz", by(controller, sensed))
    return {
        **getters,
        **_vector("controller", "actuatorThrust", by(_PID, lambda: (s.telemetry.thrust,))),
        **_vector("controller", "roll pitch yaw", lambda: firmware_signs(s.telemetry.asked_attitude)),
        **_vector("controller", "rollRate pitchRate yawRate", lambda: firmware_signs(s.telemetry.asked_rates)),
        **_vector("posCtl", "targetX targetY targetZ", by(_PID, lambda: heading(s.setpoint.position))),
        **_vector("posCtl", "bodyX bodyY", by(_PID, lambda: heading(s.telemetry.position))),
        **_vector("posCtl", "bodyVX bodyVY", by(_PID, lambda: heading(s.telemetry.velocity))),
    }


def _decks(s: Snapshot) -> dict[str, Getter]:
    """What decks that are plugged in measure."""
    down = any(deck.looks_down for deck in s.decks)
    lighthouse = any(deck.positions for deck in s.decks)

    def below() -> float:
        x, y, _, _ = s.telemetry.quaternion
        upright = 1.0 - 2.0 * (x * x + y * y)
        distance = 1000.0 * s.telemetry.height / upright if upright > 0.0 else math.inf
        return distance if distance < _RANGE_MAX else _NOTHING_SEEN

    out: dict[str, Getter] = {}
    if down:
        out["range.zrange"] = below
    if lighthouse:
        out["lighthouse.status"] = lambda: _SENDING_POSES if s.uptime - s.measured < _LIGHTHOUSE_MEMORY else 0
    return out


def _kalman(s: Snapshot) -> dict[str, Getter]:
    def wxyz() -> tuple[float, ...]:
        x, y, z, w = s.telemetry.quaternion
        return (w, x, y, z)

    def measured() -> tuple[float, ...]:
        return s.measurement.position if s.measurement else (0.0, 0.0, 0.0)

    def measured_quaternion() -> tuple[float, ...]:
        quaternion = s.measurement.quaternion if s.measurement else None
        return quaternion or (0.0, 0.0, 0.0, 0.0)

    return {
        **_vector("kalman", "stateX stateY stateZ", lambda: s.telemetry.position),
        **_vector("kalman", "statePX statePY statePZ", lambda: to_body(s.telemetry.quaternion, s.telemetry.velocity)),
        **_vector("kalman", "varX varY varZ", lambda: s.telemetry.variance_position),
        **_vector("kalman", "varPX varPY varPZ", lambda: s.telemetry.variance_velocity),
        **_vector("kalman", "varD0 varD1 varD2", lambda: s.telemetry.variance_attitude),
        **_vector("kalman", "q0 q1 q2 q3", wxyz),
        "locSrvZ.tick": lambda: max(0.0, s.measured) * 1000.0,
        **_vector("locSrv", "x y z", measured),
        **_vector("ext_pos", "X Y Z", measured),
        **_vector("locSrv", "qx qy qz qw", measured_quaternion),
    }


def _system(s: Snapshot) -> dict[str, Getter]:
    return {
        "supervisor.info": lambda: s.info,
        "sys.canfly": lambda: s.info >> 3 & 1,
        "sys.isFlying": lambda: s.info >> 4 & 1,
        "sys.isTumbled": lambda: s.info >> 5 & 1,
        "memTst.errCntW": lambda: s.tester_errors,
        "pm.vbat": lambda: s.telemetry.battery_voltage,
        "pm.vbatMV": lambda: s.telemetry.battery_voltage * 1000.0,
        "pm.state": lambda: _LOW_POWER if s.battery_low else 0,
        "pm.batteryLevel": lambda: 10 * min(9, sum(s.telemetry.battery_voltage > v for v in _CHARGE)),
        "radio.rssi": lambda: 40,
        "radio.isConnected": lambda: s.connected,
        "radio.numRxUc": lambda: s.packets_received,
    }
