"""Robots that fall behind: a deviation that is all along the way, and grows with the speed."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from deploy.analysis.evidence import Evidence, Mask
from deploy.analysis.findings import Finding, Level
from deploy.analysis.tracking import Tracking

_LEAST = 0.5  # s of the search
_LATE = 0.15  # s behind that are too much
_FAR = 0.05  # m behind, on average, that are too much
_EXPLAINED = 0.7  # of the mean square deviation
_REMEDIES = {
    "pid": "fly with controller: mellinger, which knows the speed, or lower limits.speed and limits.acceleration",
    "mellinger": "lower limits.acceleration, or raise ctrlMel.kp_xy and kd_xy",
}


def following(e: Evidence) -> Iterator[Finding]:
    """Who is late by his controller; late setpoints are ``clocks``' business."""
    late = {item.robot: item.setpoint for item in e.timings}
    for track, seen in e.followed():
        lag, explained = _behind(track, seen)
        own = late.get(track.robot, math.nan)
        far = lag > _LATE or (lag > 0.0 and track.mean > _FAR)
        if explained < _EXPLAINED or not far or own > lag / 2.0:
            continue
        speed = np.linalg.norm(np.gradient(track.reference, track.t, axis=0)[seen], axis=1).max()
        text = (
            f"{track.robot} fell behind its trajectory by {lag * 1000:.0f} ms, {track.mean * 100:.0f} cm on average, "
            f"at up to {speed:.1f} m/s"
        )
        t = None if e.window is None else e.window.start + track.largest_at
        remedy = _REMEDIES[e.mission.flight.controller]
        yield Finding(Level.WARN, "falls behind", text, remedy, (track.robot,), t, cause=True)


def _behind(track: Tracking, seen: Mask) -> tuple[float, float]:
    """How late [s], and how much of the mean square deviation that explains: deviation = −lag · speed."""
    t = track.t[seen]
    if t[-1] - t[0] < _LEAST:
        return 0.0, 0.0
    speed = np.gradient(track.reference, track.t, axis=0)[seen]
    deviation = track.deviation[seen]
    power, square = float((speed**2).sum()), float((deviation**2).sum())
    if power <= 0.0 or square <= 0.0:
        return 0.0, 0.0
    lag = -float((deviation * speed).sum()) / power
    return lag, lag**2 * power / square
