"""The flight log of a rehearsal: somebody listens to what is written."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from deploy.flightlog.writer import FlightLog


class RehearsalLog(FlightLog):
    """A flight log that tells ``listener(t, name, text)`` of every event."""

    listener: Callable[[float, str, str], None] | None = None

    def event(
        self,
        t: float,
        name: str,
        text: str,
        *,
        phase: str = "",
        robot: str = "",
        level: Literal["info", "warning", "fault"] = "info",
        value: float | None = None,
        kind: str = "",
    ) -> None:
        """Write it down and tell the listener."""
        super().event(t, name, text, phase=phase, robot=robot, level=level, value=value, kind=kind)
        if self.listener is not None:
            self.listener(t, name, text)
