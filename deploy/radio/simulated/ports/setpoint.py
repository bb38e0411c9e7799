"""Ports 3 and 7, low-level setpoints: who may send them, and what they do to the high-level planner.

A setpoint (crtp_commander.c) stops the planner and keeps priority over it until the client notifies that it stops
sending them. cflib's ``close_link`` sends a zero one on port 3: a flying drone drops.
"""

from __future__ import annotations

from collections.abc import Callable

from deploy.radio.simulated.commander import Commander, Priority
from deploy.radio.simulated.high_level.commander import HighLevelCommander
from deploy.radio.simulated.interface import Setpoint
from deploy.radio.simulated.parameters import Parameters
from deploy.radio.simulated.ports.setpoint_types import GENERIC, RPYT, FlightModes, decode_rpyt

LEGACY_PORT, GENERIC_PORT = 3, 7
_SETPOINTS, _META = 0, 1
_NOTIFY_STOP = 0


class SetpointPorts:
    """Both setpoint ports of one drone.

    Args:
        commander: whom to offer setpoints.
        high_level: whose planner they stop.
        parameters: flight modes and scales.
        now: seconds since boot.
    """

    def __init__(
        self,
        commander: Commander,
        high_level: HighLevelCommander,
        parameters: Parameters,
        now: Callable[[], float],
    ) -> None:
        self._commander, self._high_level, self._now = commander, high_level, now
        self._parameters = parameters
        self._thrust_locked = True

    def receive_legacy(self, channel: int, data: bytes) -> None:
        """Roll, pitch, yaw rate, thrust. Thrust counts only after a zero one (protection on connect)."""
        if channel != 0 or len(data) < RPYT.size:
            return
        roll, pitch, yaw, thrust = RPYT.unpack_from(data)
        if self._commander.priority < Priority.CRTP:
            self._thrust_locked = True
        if thrust == 0:
            self._thrust_locked = False
        self._take(decode_rpyt(roll, pitch, yaw, thrust, self._thrust_locked, FlightModes.of(self._parameters)))

    def receive_generic(self, channel: int, data: bytes) -> None:
        """Typed setpoints on channel 0, "notify setpoint stop" on channel 1."""
        if channel == _META and data[:1] == bytes([_NOTIFY_STOP]):
            self._commander.relax()
        elif channel == _SETPOINTS and data and data[0] in GENERIC:
            self._take(GENERIC[data[0]](data[1:], self._parameters))

    def _take(self, setpoint: Setpoint) -> None:
        self._commander.offer(setpoint, Priority.CRTP, self._now())
        self._high_level.planner.stop()
