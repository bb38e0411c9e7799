"""The report's table of maps that changed in flight, and what became of each."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from deploy.analysis.record import FlightAnalysis
from deploy.flightlog.reader import Event
from deploy.report.playback import zero_time
from deploy.report.tables import moment, table
from deploy.report.words import number, scientific


def replans_table(analysis: FlightAnalysis) -> str:
    """Per change: when it was known, how the time to its joint was spent, E before and after; empty without changes."""
    events = analysis.record.events
    begins = [k for k, event in enumerate(events) if event.name == "map_change"]
    if not begins:
        return ""
    zero, budget = zero_time(analysis), analysis.flight_plan.mission.replanning.budget
    rows = [_row(events[begin:end], zero, budget) for begin, end in pairwise([*begins, len(events)])]
    headings = ["known at [s]", "planning, charged [s]", "uploaded after [s]", "to spare [s]", "decided at [s]"]
    headings += ["E before", "E after", "what became of it"]
    return table(headings, rows, "Maps that changed in flight", tuple(range(7)))


def _row(events: Sequence[Event], zero: float, budget: float) -> list[str]:
    """One change: the events from it to the next."""
    change = events[0]
    planned, uploaded, taken, kept = (
        next((event for event in events if event.name == name), None)
        for name in ("replanned", "replan_uploaded", "take_over", "old_plan")
    )
    before = change.value
    became = "flown by all" if taken else kept.text if kept else change.text if before is None else "the flight ended"
    return [
        moment(change.t - zero, f"{change.t - zero:.1f}"),
        number(budget if planned else None, 1),
        number(uploaded.t - change.t - budget if uploaded else None, 1),
        number(uploaded.value if uploaded else None, 1),
        number(taken.t - zero if taken else None, 1),
        scientific(before) if before is not None else "–",
        scientific(taken.value) if taken and taken.value is not None else "–",
        became,
    ]
