"""Batteries that are empty, worn, or weaker than their neighbours'."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from deploy.analysis.evidence import Evidence
from deploy.analysis.findings import Finding, Level
from missions.airframes import airframe

_NEARLY = 0.2  # V above the limit, as in flight
_WORN = 1.8  # times the sag that the airframe's battery should have
_SHORT = 30.0  # s of flight left that are too few


def batteries(e: Evidence) -> Iterator[Finding]:
    """One finding a battery at most."""
    frame = airframe(e.mission.flight.airframe)
    expected = frame.internal_resistance * frame.hover_power / (0.9 * frame.voltage_full)  # [V]
    limit = e.mission.safety.battery_limit
    lowest = [item.smallest for item in e.batteries if math.isfinite(item.smallest)]
    ended = any(event.name == "battery" and event.level == "fault" for event in e.record.events)
    for item in e.batteries:
        others = [value for value in lowest if value != item.smallest]
        beside = f", {np.median(others) - item.smallest:.2f} V below the others" if others else ""
        remedy = "charge it before the next flight; if it was full, replace it"
        if item.low or item.smallest < limit + _NEARLY:
            text = f"{item.robot}'s battery fell to {item.smallest:.2f} V{beside}; it began with {item.start:.2f} V"
            level = Level.FAIL if ended and item.low else Level.WARN
        elif item.sag > _WORN * expected:
            text = (
                f"{item.robot}'s battery sags by {item.sag:.2f} V when the motors start; a good one by {expected:.2f} V"
            )
            level, remedy = Level.WARN, "replace the battery, or clean its contacts"
        elif item.left < _SHORT:
            text = f"{item.robot} could have searched for {item.left:.0f} s more only"
            level = Level.WARN
        else:
            continue
        yield Finding(level, "weak battery", text, remedy, (item.robot,), cause=True)
