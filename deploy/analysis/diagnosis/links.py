"""Robots that were no longer heard: whether they fell silent, fell down, or the dongle went."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from deploy.analysis.evidence import Evidence
from deploy.analysis.findings import Finding, Level
from deploy.flightlog.reader import Event

_FALL_TIME = 1.5  # s after its last word in which a drone without thrust is down from any height of a laboratory
_FALLEN = 0.6  # of its height that it lost meanwhile


def links(e: Evidence) -> Iterator[Finding]:
    """One finding a lost robot."""
    told: set[str] = set()
    for event in e.record.events:
        if event.name == "link" and event.level == "fault" and event.robot and event.robot not in told:
            told.add(event.robot)
            yield _lost(e, event)


def _lost(e: Evidence, event: Event) -> Finding:
    robot = event.robot
    heard = e.record.of(robot, "estimate")
    last = float(heard.t[-1]) if heard is not None and len(heard) and heard.t[-1] < event.t else event.t
    name, text, remedy = (
        "silence",
        f"{robot} was not heard any more {e.when(last)}, and flew on",
        "look for a shadow, another transmitter on its channel, or a loose antenna",
    )
    if _fell(e, robot, last):
        name = "restart"
        text = f"{robot} went silent {e.when(last)} and fell: it restarted or lost its power"
        remedy = "check the battery's connector and voltage under load; read the drone's console for an assertion"
    elif "unplugged" in event.text or "Error communicating" in event.text:
        name, text = "dongle", f"the connection to {robot} broke at once {e.when(last)}: {event.text}"
        remedy = "check the dongle's USB port, cable and power saving"
    return Finding(Level.FAIL, name, text, remedy, (robot,), last, cause=True)


def _fell(e: Evidence, robot: str, t: float) -> bool:
    poses = e.record.of(robot, "pose")
    if poses is None or len(poses) < 2:
        return False
    z = poses["position"][:, 2]
    before = z[(poses.t > t - 0.5) & (poses.t <= t)]
    after = z[(poses.t > t) & (poses.t <= t + _FALL_TIME)]
    if not len(before) or not len(after):
        return False
    height = float(np.median(before))
    return bool(height > 0.1 and np.nanmin(after) < (1.0 - _FALLEN) * height)
