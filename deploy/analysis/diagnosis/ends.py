"""How a flight ended that was not to end so: the operator, a robot that rolled over, a computer that died."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from deploy.analysis.diagnosis.actuators import actuators
from deploy.analysis.evidence import Evidence
from deploy.analysis.findings import Finding, Level
from deploy.analysis.telemetry import tilt_angles

_ROLLED = math.radians(60.0)
_QUICK = 0.5  # s before it in which the tilt is told
_TOGETHER = 0.5  # s within which all records end when their writer does


def ends(e: Evidence) -> Iterator[Finding]:
    """Roll-overs, the operator's word, the computer's death."""
    yield from _rolled_over(e)
    for event in e.record.events:
        if event.name in {"abort", "emergency"} and "operator" in event.text:
            text = f"the operator ended the flight {e.when(event.t)}: {event.text}"
            yield Finding(Level.FAIL, "operator", text, "", (), event.t, cause=True)
    yield from _cut(e)


def _rolled_over(e: Evidence) -> Iterator[Finding]:
    explained = {robot for item in actuators(e) if item.name == "weak motor" for robot in item.robots}
    for robot in e.names:
        t, tilt = tilt_angles(e.record, robot)
        over = np.flatnonzero(tilt > _ROLLED)
        if not len(over) or robot in explained:
            continue
        k = int(over[0])
        before = tilt[(t < t[k]) & (t >= t[k] - _QUICK)]
        least = math.degrees(float(before.min())) if len(before) else math.nan
        text = (
            f"{robot} rolled over {e.when(float(t[k]))}: its tilt went from {least:.0f}° to "
            f"{math.degrees(float(tilt[k])):.0f}° within {_QUICK:g} s"
        )
        remedy = "it was hit, or lost a propeller: watch the playback there, and look at propellers and motor mounts"
        yield Finding(Level.FAIL, "tumble", text, remedy, (robot,), float(t[k]), cause=True)


def _cut(e: Evidence) -> Iterator[Finding]:
    """A log that ends in the middle of everything: not the radio went, for poses end as well."""
    phases = [event.phase for event in e.record.events if event.phase]
    ends_at = [float(series.t[-1]) for name, series in e.record.series.items() if name.count("/") > 1 and len(series)]
    if e.record.complete or not ends_at or not phases or phases[-1] in {"landed", "aborted", "emergency", "cancelled"}:
        return
    last = max(ends_at)
    if last - float(np.median(ends_at)) < _TOGETHER:
        text = f"the log ends in the air {e.when(last)}: this computer, or the program, died there"
        remedy = f"drones then do what safety.on_host_loss says ({e.mission.safety.on_host_loss}); read its log"
        yield Finding(Level.FAIL, "host died", text, remedy, (), last, cause=True)
