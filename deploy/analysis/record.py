"""Everything the report and the terminal say about a flight, as one record."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

from deploy.analysis.align import MissionWindow, Motion
from deploy.analysis.coverage import Coverage
from deploy.analysis.findings import Verdict
from deploy.analysis.health import BatteryUse, LinkUse, PoseFeed
from deploy.analysis.meetings import PairMeetings
from deploy.analysis.separation import Separation
from deploy.analysis.switches import FlownSwitch
from deploy.analysis.timing import Timing
from deploy.analysis.tracking import Tracking
from deploy.flightlog.reader import FlightRecord
from planner.flightplan import FlightPlan


@dataclass(frozen=True)
class FlightAnalysis:
    """A flight, judged.

    Attributes:
        record: the log. flight_plan: what was to be flown. simulated: whether it was a rehearsal.
        window: when the search was flown; None if it never began.
        motion: where everybody was; None if nobody was ever seen.
        switches: where legs of trajectories followed one another; empty if everybody had one.
        coverage, tracking, timings, separation, meetings, batteries, links, feeds: the figures,
            robots in the mission's order.
        verdict: what to think of it.
    """

    record: FlightRecord
    flight_plan: FlightPlan
    simulated: bool
    window: MissionWindow | None
    motion: Motion | None
    coverage: Coverage
    tracking: tuple[Tracking, ...]
    timings: tuple[Timing, ...]
    switches: tuple[FlownSwitch, ...]
    separation: Separation | None
    meetings: tuple[PairMeetings, ...]
    batteries: tuple[BatteryUse, ...]
    links: tuple[LinkUse, ...]
    feeds: tuple[PoseFeed, ...]
    verdict: Verdict

    def summary(self) -> dict[str, object]:
        """The figures for machines: plain JSON, what is not known is null."""
        flown = self.coverage.flown
        out = {
            "mission": self.flight_plan.mission.name,
            "verdict": self.verdict.level.name,
            "findings": [{**dataclasses.asdict(item), "level": item.level.name} for item in self.verdict.findings],
            "simulated": self.simulated,
            "mission_complete": bool(self.window and self.window.complete),
            "ergodicity": {
                "planned": self.coverage.planned.ergodicity,
                "certified": self.coverage.certified.ergodicity,
                "flown": flown.ergodicity if flown else math.nan,
            },
            "tracking": {
                item.robot: {"mean": item.mean, "p95": item.p95, "largest": item.largest, "lag": item.mean_lag}
                for item in self.tracking
            },
            "switches": [dataclasses.asdict(item) for item in self.switches],
            "smallest_separation": self.separation.smallest if self.separation else math.nan,
            "all_met": flown.all_met if flown else None,
            "probability_worst": flown.probability_worst if flown else math.nan,
            "batteries": {item.robot: dataclasses.asdict(item) for item in self.batteries},
            "links": {item.robot: dataclasses.asdict(item) for item in self.links},
            "dropped_records": self.record.dropped,
            "log_complete": self.record.complete,
        }
        return {key: _json(value) for key, value in out.items()}


def _json(value: object) -> object:
    if isinstance(value, dict):
        return {key: _json(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_json(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
