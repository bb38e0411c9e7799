"""Port 13, platform: versions and the deprecated arming requests (firmware platformservice.c)."""

from __future__ import annotations

from deploy.radio.simulated.ports import Send
from deploy.radio.simulated.supervisor import Supervisor

PORT = 13
PROTOCOL_VERSION = 12
_COMMAND, _VERSION = 0, 1
_ARM, _RECOVER, _NOTIFY = 1, 2, 3


class PlatformPort:
    """Says what this is; arms in the way older clients ask for.

    Args:
        send: where answers go.
        supervisor: who decides on arming.
        firmware: firmware version string.
        device: device type name.
    """

    def __init__(self, send: Send, supervisor: Supervisor, firmware: str = "2026.08", device: str = "CF21") -> None:
        self._send, self._supervisor = send, supervisor
        self._versions = {
            0: bytes([0, PROTOCOL_VERSION, 0, 0, 0]),
            1: b"\x01" + firmware.encode(),
            2: b"\x02" + device.encode(),
        }

    def receive(self, channel: int, data: bytes) -> None:
        """Versions on channel 1, commands on channel 0; there is no app to answer on channel 2."""
        if not data:
            return
        if channel == _VERSION and data[0] in self._versions:
            self._send(PORT, _VERSION, self._versions[data[0]])
        elif channel == _COMMAND:
            self._command(data)

    def _command(self, data: bytes) -> None:
        if data[0] == _ARM:
            granted = self._supervisor.request_arming(bool(data[1:2].strip(b"\0")))
            self._send(PORT, _COMMAND, bytes([_ARM, granted, self._supervisor.armed]))
        elif data[0] == _RECOVER:
            granted = self._supervisor.request_recovery()
            self._send(PORT, _COMMAND, bytes([_RECOVER, granted, not self._supervisor.is_crashed]))
        elif data[0] == _NOTIFY:
            self._send(PORT, _COMMAND, data)
