"""What the bytes of low-level setpoints mean (firmware crtp_commander_rpyt.c, crtp_commander_generic.c).

Angles travel in degrees; the wire's pitch is the firmware's legacy one, nose up, with the opposite sign of a rotation
about the body's y axis. Yaw rates of types 1, 2 and 5, and those of port 3, are the older ones with the sign turned.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping
from typing import NamedTuple

from deploy.radio.simulated.interface import ZERO, Setpoint, SetpointMode, Vec3
from deploy.radio.simulated.parameters import Parameters
from deploy.radio.simulated.ports import FirmwareAssertion
from deploy.radio.simulated.quaternion import decompress, euler

RPYT = struct.Struct("<fffH")
_LEAST_THRUST, _MOST_THRUST = 1000, 60000
_THRUST_CENTRE = 32767.0
_DEGREES_PER_SPEED = 30.0  # roll and pitch stick of position hold: 30 degrees are 1 m/s
_FOUR = struct.Struct("<ffff")
_FULL_STATE = struct.Struct("<9hI3h")
_MANUAL = struct.Struct("<fffH?")
_CPPM = struct.Struct("<BHHHH")
_STICK_CENTRE, _STICK_REACH, _STICK_LOW, _STICK_SPAN = 1500.0, 500.0, 1000.0, 1000.0

Decoder = Callable[[bytes, Parameters], Setpoint]


class FlightModes(NamedTuple):
    """Parameters flightmode.*: what the four numbers on port 3 mean."""

    altitude_hold: bool = False  # thrust is a climb rate
    position_set: bool = False  # x, y, z and yaw
    position_hold: bool = False  # roll and pitch are speeds
    roll_angle: bool = True  # or roll rate
    pitch_angle: bool = True
    plus: bool = False  # motor 1 is ahead instead of the space between 1 and 4

    @staticmethod
    def of(parameters: Parameters) -> FlightModes:
        """As the parameters are set. Raises FirmwareAssertion for carefree mode, which the firmware asserts against."""
        yaw_mode = parameters["flightmode.yawMode"]
        if yaw_mode == 0:
            raise FirmwareAssertion("flightmode.yawMode 0 (carefree) is not implemented in the firmware")
        names = ("althold", "posSet", "poshold", "stabModeRoll", "stabModePitch")
        hold, place, hover, roll, pitch = (bool(parameters[f"flightmode.{name}"]) for name in names)
        return FlightModes(hold, place, hover, roll, pitch, plus=yaw_mode == 1)


def decode_rpyt(roll: float, pitch: float, yaw: float, thrust: int, locked: bool, modes: FlightModes) -> Setpoint:
    """Setpoint of port 3.

    Args:
        roll: [deg], or [deg/s] in rate mode.
        pitch: the same.
        yaw: [deg/s]; [deg] when a position is set.
        thrust: 0..65535.
        locked: no zero thrust has been seen yet.
        modes: how to read them.
    """
    if modes.position_set and thrust:
        place = (-pitch, roll, thrust / 1000.0)
        return Setpoint(SetpointMode.POSITION, place, yaw=math.radians(yaw))
    power = 0.0 if locked or thrust < _LEAST_THRUST else float(min(thrust, _MOST_THRUST))
    climb = (0.0, 0.0, (thrust - _THRUST_CENTRE) / _THRUST_CENTRE)
    turn = _turning(-yaw)
    if modes.position_hold:
        # Without altitude hold the firmware flies x and y by position and thrust by hand: absent here, it holds level.
        if modes.altitude_hold:
            speed = (pitch / _DEGREES_PER_SPEED, roll / _DEGREES_PER_SPEED, climb[2])
            return Setpoint(SetpointMode.VELOCITY, velocity=speed, omega=turn)
        roll = pitch = 0.0
    elif modes.plus:
        roll, pitch = (roll - pitch) * math.sqrt(0.5), (pitch + roll) * math.sqrt(0.5)
    attitude = (math.radians(roll), -math.radians(pitch))
    if modes.altitude_hold:
        return Setpoint(SetpointMode.CLIMB, velocity=climb, attitude=attitude, omega=turn)
    if not power:
        return Setpoint()
    if not modes.roll_angle and not modes.pitch_angle and not modes.position_hold:
        return Setpoint(SetpointMode.RATES, omega=(*attitude, turn[2]), thrust=power)
    return Setpoint(SetpointMode.ATTITUDE, attitude=attitude, omega=turn, thrust=power)


def _exactly(layout: struct.Struct, data: bytes) -> tuple[float, ...]:
    if len(data) != layout.size:
        raise FirmwareAssertion(f"setpoint: got {len(data)} bytes, needs {layout.size}")
    return layout.unpack(data)


def _stop(data: bytes, _: Parameters) -> Setpoint:
    _exactly(struct.Struct("<"), data)
    return Setpoint()


def _velocity(sign: float) -> Decoder:
    def decode(data: bytes, _: Parameters) -> Setpoint:
        x, y, z, yaw_rate = _exactly(_FOUR, data)
        return Setpoint(SetpointMode.VELOCITY, velocity=(x, y, z), omega=_turning(sign * yaw_rate))

    return decode


def _z_distance(sign: float) -> Decoder:
    def decode(data: bytes, _: Parameters) -> Setpoint:
        roll, pitch, yaw_rate, z = _exactly(_FOUR, data)
        attitude = (math.radians(roll), -math.radians(pitch))
        return Setpoint(SetpointMode.HEIGHT, (0.0, 0.0, z), attitude=attitude, omega=_turning(sign * yaw_rate))

    return decode


def _hover(sign: float) -> Decoder:
    def decode(data: bytes, _: Parameters) -> Setpoint:
        x, y, yaw_rate, z = _exactly(_FOUR, data)
        return Setpoint(SetpointMode.HOVER, (0.0, 0.0, z), (x, y, 0.0), omega=_turning(sign * yaw_rate))

    return decode


def _altitude_hold(data: bytes, _: Parameters) -> Setpoint:
    roll, pitch, yaw_rate, z = _exactly(_FOUR, data)
    attitude = (math.radians(roll), -math.radians(pitch))
    return Setpoint(SetpointMode.CLIMB, velocity=(0.0, 0.0, z), attitude=attitude, omega=_turning(yaw_rate))


def _full_state(data: bytes, _: Parameters) -> Setpoint:
    f = _exactly(_FULL_STATE, data)
    position, velocity, acceleration = (_thousandths(f[i : i + 3]) for i in (0, 3, 6))
    yaw = euler(decompress(int(f[9])))[2]
    return Setpoint(SetpointMode.FULL, position, velocity, acceleration, ZERO, yaw, _thousandths(f[10:13]))


def _position(data: bytes, _: Parameters) -> Setpoint:
    x, y, z, yaw = _exactly(_FOUR, data)
    return Setpoint(SetpointMode.POSITION, (x, y, z), yaw=math.radians(yaw))


def _manual(data: bytes, _: Parameters) -> Setpoint:
    roll, pitch, yaw_rate, thrust, by_rate = _exactly(_MANUAL, data)
    lean = (math.radians(roll), -math.radians(pitch))
    turn = math.radians(yaw_rate)
    if by_rate:
        return Setpoint(SetpointMode.RATES, omega=(*lean, turn), thrust=thrust)
    return Setpoint(SetpointMode.ATTITUDE, attitude=lean, omega=(0.0, 0.0, turn), thrust=thrust)


def _cppm(data: bytes, parameters: Parameters) -> Setpoint:
    """Sticks of a remote control, 1000 to 2000; the first auxiliary channel, if any, switches self-levelling off."""
    if len(data) < _CPPM.size:
        raise FirmwareAssertion(f"CPPM setpoint: got {len(data)} bytes, needs {_CPPM.size} at least")
    head, *sticks = _CPPM.unpack_from(data)
    auxiliary = head & 0x0F
    if len(data) != _CPPM.size + 2 * auxiliary:
        raise FirmwareAssertion(f"CPPM setpoint: got {len(data)} bytes for {auxiliary} auxiliary channels")
    levels = not (auxiliary and int.from_bytes(data[_CPPM.size : _CPPM.size + 2], "little") < _STICK_CENTRE)
    roll, pitch, yaw = (-(stick - _STICK_CENTRE) / _STICK_REACH for stick in sticks[:3])
    kind = "ang" if levels else "rate"
    lean = (
        math.radians(roll * parameters[f"cppm.{kind}Roll"]),
        -math.radians(pitch * parameters[f"cppm.{kind}Pitch"]),
    )
    turn = math.radians(yaw * parameters["cppm.rateYaw"])
    thrust = max(0.0, (sticks[3] - _STICK_LOW) / _STICK_SPAN * 65535.0)
    if levels:
        return Setpoint(SetpointMode.ATTITUDE, attitude=lean, omega=(0.0, 0.0, turn), thrust=thrust)
    return Setpoint(SetpointMode.RATES, omega=(*lean, turn), thrust=thrust)


def _turning(degrees_per_second: float) -> Vec3:
    return (0.0, 0.0, math.radians(degrees_per_second))


def _thousandths(values: tuple[float, ...]) -> Vec3:
    return (values[0] / 1000.0, values[1] / 1000.0, values[2] / 1000.0)


GENERIC: Mapping[int, Decoder] = {
    0: _stop,
    1: _velocity(-1.0),
    2: _z_distance(-1.0),
    3: _cppm,
    4: _altitude_hold,
    5: _hover(-1.0),
    6: _full_state,
    7: _position,
    8: _velocity(1.0),
    9: _z_distance(1.0),
    10: _hover(1.0),
    11: _manual,
}
"""Decoders of port 7 by packet type; they raise FirmwareAssertion where the firmware asserts the length."""
