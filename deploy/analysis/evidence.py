"""What a flight is judged and diagnosed from."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deploy.analysis.align import MissionWindow, Motion
from deploy.analysis.coverage import Coverage
from deploy.analysis.health import BatteryUse, LinkUse, PoseFeed
from deploy.analysis.separation import Separation
from deploy.analysis.timing import Timing
from deploy.analysis.tracking import Tracking
from deploy.flightlog.reader import FlightRecord
from missions.schema import Mission
from planner.certificate.record import Certificate

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Evidence:
    """What a verdict is made from; sequences are in the mission's order of robots, or empty if there was no search."""

    mission: Mission
    certificate: Certificate
    record: FlightRecord
    window: MissionWindow | None
    motion: Motion | None
    coverage: Coverage
    tracking: Sequence[Tracking]
    timings: Sequence[Timing]
    separation: Separation | None
    batteries: Sequence[BatteryUse]
    links: Sequence[LinkUse]
    feeds: Sequence[PoseFeed]

    @property
    def names(self) -> tuple[str, ...]:
        """The robots."""
        return tuple(robot.name for robot in self.mission.robots)

    def when(self, t: float) -> str:
        """A flight clock time on the page's time axis, which begins with the search."""
        return f"at {t - self.window.start:.1f} s" if self.window is not None else f"at {t:.1f} s of the flight clock"

    def followed(self) -> Iterator[tuple[Tracking, Mask]]:
        """Everybody who was seen in the search, and at which of his samples (S,) he was."""
        for track in self.tracking:
            seen = np.isfinite(track.error)
            if seen.sum() > 1:
                yield track, seen
