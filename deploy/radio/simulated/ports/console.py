"""Port 0, console: text the firmware prints (firmware console.c)."""

from __future__ import annotations

from deploy.radio.simulated.ports import Send

PORT = 0
_LONGEST = 30


class ConsolePort:
    """Writes text; what clients send here is ignored."""

    def __init__(self, send: Send) -> None:
        self._send = send

    def receive(self, channel: int, data: bytes) -> None:
        """Nothing listens on the console."""

    def write(self, text: str) -> None:
        """Print ASCII text (clients decode every packet by itself, so a character must not be split)."""
        encoded = text.encode("ascii", "replace")
        for start in range(0, len(encoded), _LONGEST):
            self._send(PORT, 0, encoded[start : start + _LONGEST])
