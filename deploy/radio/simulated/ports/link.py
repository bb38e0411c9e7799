"""Port 15, link service: echo, source and sink (firmware crtpservice.c)."""

from __future__ import annotations

from deploy.radio.simulated.ports import Send

PORT = 15
_ECHO, _SOURCE = 0, 1
_IDENTITY = b"Bitcraze Crazyflie".ljust(30, b"\0")


class LinkPort:
    """Answers pings; names itself when asked for data."""

    def __init__(self, send: Send) -> None:
        self._send = send

    def receive(self, channel: int, data: bytes) -> None:
        """Echo comes back, source gives the product name, the sink swallows."""
        if channel == _ECHO:
            self._send(PORT, _ECHO, data)
        elif channel == _SOURCE:
            self._send(PORT, _SOURCE, _IDENTITY)
