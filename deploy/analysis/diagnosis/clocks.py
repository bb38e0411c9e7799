"""Lags that are not the controller's: trajectories begun late, and stamps of motion capture that are off."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from statistics import median

from deploy.analysis.evidence import Evidence
from deploy.analysis.findings import Finding, Level

_OFF = 0.08  # s beyond what telemetry and a turn of the loop explain
_ALONE = 0.05  # s by which one robot differs from what the others share


def clocks(e: Evidence) -> Iterator[Finding]:
    """An offset that everybody shares is told once, one robot's own by its name."""
    # A pose takes half a round trip to the drone, and what the drone makes of it half a round trip back.
    radio = {link.robot: 0.0 if math.isnan(link.latency_p95) else link.latency_p95 / 1000.0 for link in e.links}
    stamps = {
        item.robot: item.pose - item.estimate + radio[item.robot]
        for item in e.timings
        if _known(item.pose, item.estimate)
    }
    for who, robots, off in _offsets(stamps):
        word = "late" if off > 0 else "early"
        text = f"motion capture's stamps of {who} are {abs(off) * 1000:.0f} ms {word} by the drones' own estimates"
        remedy = "set motion_capture.latency, or synchronise the two computers' clocks"
        yield Finding(Level.WARN, "time offset", text, remedy, robots, cause=True)
    starts = {item.robot: item.setpoint - radio[item.robot] / 2.0 for item in e.timings if _known(item.setpoint)}
    for who, robots, off in _offsets(starts):
        word = "late" if off > 0 else "early"
        text = f"the setpoints of {who} ran {abs(off) * 1000:.0f} ms {word}: so did the start of the trajectory"
        remedy = "set radio.latency to what the link takes, and look at the radio's latency below"
        yield Finding(Level.WARN, "time offset", text, remedy, robots, cause=True)


def _known(*values: float) -> bool:
    return all(math.isfinite(value) for value in values)


def _offsets(by_robot: Mapping[str, float]) -> Iterator[tuple[str, tuple[str, ...], float]]:
    """Who, in words and by name, and how much [s]: the shared offset first, then those who differ from it."""
    if not by_robot:
        return
    shared = median(by_robot.values())
    if abs(shared) > _OFF:
        yield "everybody" if len(by_robot) > 1 else next(iter(by_robot)), tuple(by_robot), shared
    for robot, off in by_robot.items():
        if abs(off - shared) > _ALONE and abs(off) > _OFF:
            yield robot, (robot,), off
