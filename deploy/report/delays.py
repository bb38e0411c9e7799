"""The report's table of delays: how far apart the starts were, how prompt commands and reactions."""

from __future__ import annotations

from deploy.analysis.record import FlightAnalysis
from deploy.report.tables import table
from deploy.report.words import number

_NAMES = {"start_skew": "start skew", "command_latency": "command latency", "reaction": "reaction of the watch"}


def delays_table(analysis: FlightAnalysis) -> str:
    """One line for the starts, one a robot for commands, one a reaction; empty if the log says nothing of them."""
    rows = [
        [_NAMES[event.name], event.robot or "all", number(1000.0 * event.value, 1), event.text]
        for event in analysis.record.events
        if event.name in _NAMES and event.value is not None
    ]
    return table(["delay", "robot", "[ms]", ""], rows, "Delays by the flight's clock", (2,)) if rows else ""
