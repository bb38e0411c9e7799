"""Everything the report and the terminal say about a flight, as one record."""

from __future__ import annotations

import dataclasses
import functools
import math
from dataclasses import dataclass

from deploy.analysis.evidence import Evidence
from deploy.analysis.findings import Verdict
from deploy.analysis.meetings import PairMeetings
from deploy.analysis.sights import flown_sights
from deploy.analysis.switches import FlownSwitch
from deploy.analysis.verdict import judge
from planner.surface.seen import SeenSurface


@dataclass(frozen=True)
class FlightAnalysis(Evidence):
    """A flight, judged.

    Attributes:
        switches: where legs of trajectories followed one another; empty if everybody had one.
        meetings: of every pair, in the order of the mission's robots.
    """

    switches: tuple[FlownSwitch, ...]
    meetings: tuple[PairMeetings, ...]

    @functools.cached_property
    def verdict(self) -> Verdict:
        """What to think of it."""
        return judge(self)

    @functools.cached_property
    def sights(self) -> SeenSurface | None:
        """What was seen of the object; None where there was none, or no search."""
        return flown_sights(self)

    @property
    def simulated(self) -> bool:
        """Whether it was a rehearsal."""
        return self.record.metadata.get("backend") == "simulated"

    def summary(self) -> dict[str, object]:
        """The figures for machines: plain JSON, what is not known is null."""
        flown = self.coverage.flown
        out = {
            "mission": self.mission.name,
            "verdict": self.verdict.level.name,
            "findings": [{**dataclasses.asdict(item), "level": item.level.name} for item in self.verdict.findings],
            "simulated": self.simulated,
            "mission_complete": bool(self.window and self.window.complete),
            "ergodicity": {
                "planned": self.coverage.planned.ergodicity,
                "certified": self.coverage.certified.ergodicity,
                "flown": flown.ergodicity if flown else math.nan,
            },
            "information_seen": self.sights.fraction if self.sights else None,
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
