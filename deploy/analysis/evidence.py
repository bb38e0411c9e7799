"""What a flight is judged and diagnosed from."""

from __future__ import annotations

from collections.abc import Iterator
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
from planner.flightplan import FlightPlan

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Evidence:
    """What a verdict is made from.

    Attributes:
        record: the log. flight_plan: what was to be flown, of those who flew.
        window: when the search was flown; None if it never began.
        motion: where everybody was; None if nobody was ever seen.
        coverage, tracking, timings, separation, batteries, links, feeds: the figures, robots in the mission's order;
            tracking and timings are empty if there was no search.
    """

    record: FlightRecord
    flight_plan: FlightPlan
    window: MissionWindow | None
    motion: Motion | None
    coverage: Coverage
    tracking: tuple[Tracking, ...]
    timings: tuple[Timing, ...]
    separation: Separation | None
    batteries: tuple[BatteryUse, ...]
    links: tuple[LinkUse, ...]
    feeds: tuple[PoseFeed, ...]

    @property
    def mission(self) -> Mission:
        """What was to be flown, in its author's words."""
        return self.flight_plan.mission

    @property
    def certificate(self) -> Certificate:
        """Of the bytes that flew."""
        return self.flight_plan.certificate

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
