"""Gaps in motion capture: everybody's at once are the system's, one robot's are its markers'."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from deploy.analysis.evidence import Evidence
from deploy.analysis.findings import Finding, Level

_GAP = 0.3  # s without a pose
_TOGETHER = 0.1  # s within which gaps begin together
_MOST = 3  # gaps of one robot that are told one by one


class Gap(NamedTuple):
    """Nobody saw this robot from begin to end, flight clock [s]."""

    robot: str
    begin: float
    end: float


def dropouts(e: Evidence) -> Iterator[Finding]:
    """One finding for each blackout, and one for each robot that was hidden."""
    gaps = [gap for name in e.names for gap in _gaps(e, name)]
    ended = any(event.name == "pose" and event.level == "fault" for event in e.record.events)
    level = Level.FAIL if ended else Level.WARN
    told: set[Gap] = set()
    for gap in sorted(gaps, key=lambda item: item.begin):
        if gap in told:
            continue
        together = [other for other in gaps if abs(other.begin - gap.begin) <= _TOGETHER]
        told |= set(together)
        if len({other.robot for other in together}) == len(e.names) > 1:
            text = f"motion capture saw nobody for {gap.end - gap.begin:.1f} s, {e.when(gap.begin)}"
            remedy = "everybody at once is the system or its network: look at its computer, cable and firewall"
            yield Finding(level, "mocap dropout", text, remedy, (), gap.begin, cause=True)
        else:
            yield from (_hidden(e, level, other) for other in together)


def _hidden(e: Evidence, level: Level, gap: Gap) -> Finding:
    text = f"{gap.robot} alone was not seen for {gap.end - gap.begin:.2f} s, {e.when(gap.begin)}"
    remedy = "its markers were hidden or came off: look at them, and at the cameras' view there"
    return Finding(level, "markers hidden", text, remedy, (gap.robot,), gap.begin, cause=True)


def _gaps(e: Evidence, robot: str) -> list[Gap]:
    """The longest gaps, the last of which may run to the end of the log."""
    series = e.record.of(robot, "pose")
    if series is None or len(series) < 2:
        return []
    others = [item.t[-1] for name, item in e.record.series.items() if len(item) and not name.startswith("/mocap")]
    end = max(others)
    t = np.append(series.t, end) if end - series.t[-1] > 2.0 * _GAP else series.t
    steps = np.diff(t)
    longest = [int(k) for k in np.argsort(-steps)[:_MOST] if steps[k] > _GAP]
    return [Gap(robot, float(t[k]), float(t[k + 1])) for k in longest]
