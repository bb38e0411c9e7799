"""The firmware's CRTP ports, one a file: bytes in, bytes out, no state but their own.

A port answers by calling ``send(port, channel, data)``. Where the firmware asserts it raises
:class:`FirmwareAssertion`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

Send = Callable[[int, int, bytes], None]


class FirmwareAssertion(Exception):
    """The firmware's ASSERT: it stops and reboots."""


class Port(Protocol):
    """Handler of one CRTP port."""

    def receive(self, channel: int, data: bytes) -> None:
        """Handle a packet of this port."""
