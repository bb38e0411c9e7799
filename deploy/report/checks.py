"""The tables of what was done before the flight: pre-flight checks, and parameters that were set."""

from __future__ import annotations

import re
from collections import defaultdict

from deploy.analysis.record import FlightAnalysis
from deploy.report.tables import table

_MARKS = {"info": "✓", "warning": "!", "fault": "✕"}
_PARAMETER = re.compile(r"([\w.]+) = ([-+.\w]+)")


def preflight_table(analysis: FlightAnalysis) -> str:
    """The pre-flight checks as they were logged; empty if there are none."""
    events = [event for event in analysis.record.events if event.name == "preflight"]
    if not events:
        return ""
    rows = [[_MARKS.get(event.level, ""), event.robot or "all", event.text] for event in events]
    bad = sum(event.level != "info" for event in events)
    said = f"{bad} of {len(events)} did not pass" if bad else f"all {len(events)} passed"
    listing = table(["", "robot", "found"], rows, "Pre-flight checks")
    return f"<details{' open' if bad else ''}><summary>Pre-flight checks: {said}</summary>{listing}</details>"


def parameters_table(analysis: FlightAnalysis) -> str:
    """On-board parameters that were set and read back: one line for each value, and who got it."""
    values: dict[tuple[str, str], list[str]] = defaultdict(list)
    for event in analysis.record.events:
        if event.name == "preflight" and event.text.startswith("parameters: "):
            for name, value in _PARAMETER.findall(event.text):
                if event.robot not in values[name, value]:
                    values[name, value].append(event.robot)
    if not values:
        return ""
    everybody = len(analysis.flight_plan.mission.robots)
    rows = [
        [name, value, "all" if len(robots) == everybody else ", ".join(robots)]
        for (name, value), robots in sorted(values.items())
    ]
    listing = table(["parameter", "value", "robots"], rows, "Parameters set, and read back", (1,))
    return f"<details><summary>Parameters changed: {len({name for name, _ in values})}</summary>{listing}</details>"
