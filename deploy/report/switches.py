"""The report's table of switches from one leg of a trajectory to the next."""

from __future__ import annotations

from itertools import groupby

from deploy.analysis.record import FlightAnalysis
from deploy.report.tables import table
from deploy.report.words import number


def switches_table(analysis: FlightAnalysis) -> str:
    """Per robot: how punctual its legs began, and the largest jump beside its bound; empty without legs."""
    rows = []
    for robot, group in groupby(analysis.switches, key=lambda item: item.robot):
        flown = list(group)
        worst = max(flown, key=lambda item: item.jump)
        rows.append(
            [
                robot,
                str(len(flown) + 1),
                number(1000 * sum(abs(item.late) for item in flown) / len(flown), 1),
                number(1000 * max(abs(item.late) for item in flown), 1),
                number(1000 * worst.jump, 1),
                number(1000 * worst.bound, 1),
                f"leg {worst.leg} at {worst.time:.1f} s",
            ]
        )
    if not rows:
        return ""
    headings = ["robot", "legs", "mean |late| [ms]", "most [ms]", "largest jump [mm]", "certified [mm]", "where"]
    return table(headings, rows, "Legs uploaded in flight: starts and jumps of the setpoint", (1, 2, 3, 4, 5))
