"""Ports 3 and 7, low-level setpoints (firmware crtp_commander.c, crtp_commander_rpyt.c, crtp_commander_generic.c).

A setpoint stops the high-level planner and keeps priority over it until the client notifies that it stops sending
them. cflib's ``close_link`` sends a zero one on port 3: a flying drone drops.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping

from deploy.radio.simulated.commander import Commander, Priority
from deploy.radio.simulated.high_level.commander import HighLevelCommander
from deploy.radio.simulated.interface import ZERO, Setpoint, SetpointMode, Vec3
from deploy.radio.simulated.ports import FirmwareAssertion
from deploy.radio.simulated.quaternion import decompress, euler

LEGACY_PORT, GENERIC_PORT = 3, 7
_SETPOINTS, _META = 0, 1
_NOTIFY_STOP = 0
_RPYT = struct.Struct("<fffH")
_LEAST_THRUST, _MOST_THRUST = 1000, 60000

Fields = tuple[float, ...]


def _stop(_: Fields) -> Setpoint:
    return Setpoint()


def _full_state(f: Fields) -> Setpoint:
    metres = [value / 1000.0 for value in f[:9]]
    rates = (f[10] / 1000.0, f[11] / 1000.0, f[12] / 1000.0)
    yaw = euler(decompress(int(f[9])))[2]
    position, velocity, acceleration = (_vec(metres[i : i + 3]) for i in (0, 3, 6))
    return Setpoint(SetpointMode.FULL, position, velocity, acceleration, ZERO, yaw, rates)


def _position(f: Fields) -> Setpoint:
    return Setpoint(SetpointMode.POSITION, (f[0], f[1], f[2]), yaw=math.radians(f[3]))


def _velocity(f: Fields, sign: float = 1.0) -> Setpoint:
    return Setpoint(SetpointMode.VELOCITY, velocity=(f[0], f[1], f[2]), omega=_turning(sign * f[3]))


def _hover(f: Fields, sign: float = 1.0) -> Setpoint:
    return Setpoint(
        SetpointMode.HOVER, position=(0.0, 0.0, f[3]), velocity=(f[0], f[1], 0.0), omega=_turning(sign * f[2])
    )


def _turning(degrees_per_second: float) -> Vec3:
    return (0.0, 0.0, math.radians(degrees_per_second))


def _vec(values: list[float]) -> Vec3:
    return (values[0], values[1], values[2])


# Types 1 and 5 are the older ones with the yaw rate's sign turned. Types 2, 3, 4, 9 and 11 are absent (ignored).
_DECODERS: Mapping[int, tuple[struct.Struct, Callable[[Fields], Setpoint]]] = {
    0: (struct.Struct("<"), _stop),
    1: (struct.Struct("<ffff"), lambda f: _velocity(f, -1.0)),
    5: (struct.Struct("<ffff"), lambda f: _hover(f, -1.0)),
    6: (struct.Struct("<9hI3h"), _full_state),
    7: (struct.Struct("<ffff"), _position),
    8: (struct.Struct("<ffff"), _velocity),
    10: (struct.Struct("<ffff"), _hover),
}


class SetpointPorts:
    """Both setpoint ports of one drone.

    Args:
        commander: whom to offer setpoints.
        high_level: whose planner they stop.
        now: seconds since boot.
    """

    def __init__(self, commander: Commander, high_level: HighLevelCommander, now: Callable[[], float]) -> None:
        self._commander, self._high_level, self._now = commander, high_level, now
        self._thrust_locked = True

    def receive_legacy(self, channel: int, data: bytes) -> None:
        """Roll, pitch [deg], yaw rate [deg/s], thrust. Thrust counts only after a zero one (protection on connect)."""
        if channel != 0 or len(data) < _RPYT.size:
            return
        roll, pitch, yaw_rate, thrust = _RPYT.unpack_from(data)
        if self._commander.priority < Priority.CRTP:
            self._thrust_locked = True
        if thrust == 0:
            self._thrust_locked = False
        if self._thrust_locked or thrust < _LEAST_THRUST:
            self._take(Setpoint())
            return
        # The wire carries pitch and yaw rate with the firmware's legacy signs.
        attitude = (math.radians(roll), -math.radians(pitch))
        self._take(
            Setpoint(
                SetpointMode.ATTITUDE, attitude=attitude, omega=_turning(-yaw_rate), thrust=min(thrust, _MOST_THRUST)
            )
        )

    def receive_generic(self, channel: int, data: bytes) -> None:
        """Typed setpoints on channel 0, "notify setpoint stop" on channel 1."""
        if channel == _META and data[:1] == bytes([_NOTIFY_STOP]):
            self._commander.relax()
        elif channel == _SETPOINTS and data and data[0] in _DECODERS:
            layout, decode = _DECODERS[data[0]]
            if len(data) != 1 + layout.size:
                raise FirmwareAssertion(f"setpoint type {data[0]}: got {len(data) - 1} bytes, needs {layout.size}")
            self._take(decode(layout.unpack_from(data, 1)))

    def _take(self, setpoint: Setpoint) -> None:
        self._commander.offer(setpoint, Priority.CRTP, self._now())
        self._high_level.planner.stop()
