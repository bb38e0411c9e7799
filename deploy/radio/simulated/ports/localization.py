"""Port 6, localisation: external positions and poses, emergency stop (firmware crtp_localization_service.c)."""

from __future__ import annotations

import struct
from collections.abc import Callable

from deploy.radio.simulated.interface import PoseMeasurement, Quat, Vec3
from deploy.radio.simulated.parameters import Parameters
from deploy.radio.simulated.quaternion import decompress
from deploy.radio.simulated.supervisor import Supervisor

PORT = 6
_POSITION, _GENERIC, _PACKED_POSITIONS = 0, 1, 2
_EMERGENCY_STOP, _FEED_WATCHDOG, _POSE, _PACKED_POSES = 3, 4, 8, 9
_XYZ, _XYZ_QUATERNION = struct.Struct("<fff"), struct.Struct("<fffffff")
_PACKED_POSITION, _PACKED_POSE = struct.Struct("<Bhhh"), struct.Struct("<BhhhI")


class LocalizationPort:
    """Collects what the drone is told about its pose.

    Args:
        parameters: standard deviations live there.
        supervisor: takes emergency stops.
        address: last byte of the radio address, the drone's id in packed packets.
        now: seconds since boot.

    Attributes:
        latest: the latest measurement, for the log.
    """

    def __init__(self, parameters: Parameters, supervisor: Supervisor, address: int, now: Callable[[], float]) -> None:
        self._parameters, self._supervisor, self._address, self._now = parameters, supervisor, address, now
        self._pending: list[PoseMeasurement] = []
        self.latest: PoseMeasurement | None = None

    def receive(self, channel: int, data: bytes) -> None:
        """Take a position or pose; nothing is answered."""
        if channel == _POSITION and len(data) >= _XYZ.size:
            self._measure(_XYZ.unpack_from(data), None)
        elif channel == _GENERIC and data:
            self._generic(data)
        elif channel == _PACKED_POSITIONS:
            for offset in range(0, len(data) - _PACKED_POSITION.size + 1, _PACKED_POSITION.size):
                robot, x, y, z = _PACKED_POSITION.unpack_from(data, offset)
                self._packed(robot, (x, y, z), None)

    def add(self, measurement: PoseMeasurement) -> None:
        """A measurement that did not come by radio."""
        self._pending.append(measurement)

    @property
    def waiting(self) -> bool:
        """Whether there is something to take."""
        return bool(self._pending)

    def take(self) -> tuple[PoseMeasurement, ...]:
        """Measurements since the last call, oldest first."""
        if not self._pending:
            return ()
        taken = tuple(self._pending)
        self._pending.clear()
        return taken

    def _generic(self, data: bytes) -> None:
        kind = data[0]
        if kind == _EMERGENCY_STOP:
            self._supervisor.emergency_stop()
        elif kind == _FEED_WATCHDOG:
            self._supervisor.feed_watchdog(self._now())
        elif kind == _POSE and len(data) > _XYZ_QUATERNION.size:
            x, y, z, qx, qy, qz, qw = _XYZ_QUATERNION.unpack_from(data, 1)
            self._measure((x, y, z), (qx, qy, qz, qw))
        elif kind == _PACKED_POSES:
            for offset in range(1, len(data) - _PACKED_POSE.size + 1, _PACKED_POSE.size):
                robot, x, y, z, quaternion = _PACKED_POSE.unpack_from(data, offset)
                self._packed(robot, (x, y, z), decompress(quaternion))

    def _packed(self, robot: int, millimetres: Vec3, quaternion: Quat | None) -> None:
        """Others' positions serve collision avoidance only, which is absent here."""
        if robot == self._address:
            x, y, z = millimetres
            self._measure((x / 1000.0, y / 1000.0, z / 1000.0), quaternion)

    def _measure(self, position: Vec3, quaternion: Quat | None) -> None:
        self.latest = PoseMeasurement(
            position,
            quaternion,
            self._parameters["locSrv.extPosStdDev"],
            self._parameters["locSrv.extQuatStdDev"],
        )
        self._pending.append(self.latest)
