"""Port 8, high-level commander: every command is answered with its return code."""

from __future__ import annotations

from deploy.radio.simulated.high_level.commander import HighLevelCommander
from deploy.radio.simulated.ports import Send

PORT = 8


class HighLevelPort:
    """Hands commands to the commander and answers command, first two argument bytes, return code."""

    def __init__(self, send: Send, commander: HighLevelCommander) -> None:
        self._send, self._commander = send, commander

    def receive(self, channel: int, data: bytes) -> None:
        """Carry a command out."""
        if channel == 0 and data:
            code = self._commander.command(data)
            self._send(PORT, 0, data[:3].ljust(3, b"\0") + bytes([code]))
