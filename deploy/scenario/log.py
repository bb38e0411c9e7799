"""The flight log of a rehearsal: somebody listens to what is written."""

from __future__ import annotations

from collections.abc import Callable
from typing import Unpack

from deploy.flightlog.events import Details
from deploy.flightlog.writer import FlightLog


class RehearsalLog(FlightLog):
    """A flight log that tells ``listener(t, name, text)`` of every event."""

    listener: Callable[[float, str, str], None] | None = None

    def event(self, t: float, name: str, text: str, *, phase: str = "", **details: Unpack[Details]) -> None:
        """Write it down and tell the listener."""
        super().event(t, name, text, phase=phase, **details)
        if self.listener is not None:
            self.listener(t, name, text)
