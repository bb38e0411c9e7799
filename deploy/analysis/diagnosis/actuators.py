"""Motors and tilt at their limits: a weak motor, too much weight, a trajectory that asks for too much."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from deploy.analysis.evidence import Evidence
from deploy.analysis.findings import Finding, Level
from deploy.analysis.telemetry import motor_share, tilt_angles
from missions.airframes import airframe
from missions.arrays import Array

_FULL = 0.98  # of a motor's range: at its limit
_OTHERS = 0.6  # of the strongest that the second strongest has at most, when one motor is weak
_WEAK_SAMPLES = 3  # that have to say so
_SHARE = 0.02  # of the time at a limit that is worth a word
_TILT_SLACK = math.radians(1.0)


def actuators(e: Evidence) -> Iterator[Finding]:
    """Weak motors first; a robot with one is not accused of saturation, too."""
    for name in e.names:
        t, share = motor_share(e.record, name)
        weak = list(_weak_motor(e, name, t, share))
        yield from weak
        if not weak:
            yield from _saturation(e, name, t, share)
        yield from _tilt(e, name)


def _weak_motor(e: Evidence, robot: str, t: Array, share: Array) -> Iterator[Finding]:
    if not len(t):
        return
    ranked = np.sort(share, axis=1)
    alone = (ranked[:, -1] >= _FULL) & (ranked[:, -2] <= _OTHERS * ranked[:, -1])
    motors = share[alone].argmax(axis=1)
    counts = np.bincount(motors, minlength=4)
    motor = int(counts.argmax())
    if counts[motor] < _WEAK_SAMPLES:
        return
    rest = np.delete(share[alone], motor, axis=1).mean()
    first = float(t[alone][motors == motor][0])
    yield Finding(
        Level.FAIL,
        "weak motor",
        f"{robot}'s motor m{motor + 1} was asked for all it has while the others averaged {rest * 100:.0f} %, "
        f"{e.when(first)}: it gives too little",
        f"replace propeller and motor m{motor + 1}; look at its connector",
        (robot,),
        first,
        cause=True,
    )


def _saturation(e: Evidence, robot: str, t: Array, share: Array) -> Iterator[Finding]:
    if e.window is None or not len(t):
        return
    searching = (t >= e.window.start) & (t <= e.window.end)
    if not searching.any():
        return
    full = (share[searching] >= _FULL).any(axis=1)
    if full.mean() <= _SHARE or full.sum() < _WEAK_SAMPLES:
        return
    first = float(t[searching][full][0])
    yield Finding(
        Level.WARN,
        "saturation",
        f"{robot} had a motor at its limit for {full.mean() * 100:.0f} % of the search, first {e.when(first)}; "
        f"mean command {share[searching].mean() * 100:.0f} %",
        "charge it, take weight off, or lower limits.acceleration",
        (robot,),
        first,
        cause=True,
    )


def _tilt(e: Evidence, robot: str) -> Iterator[Finding]:
    """The PID controller never tilts further than it may: at its limit it falls behind."""
    t, tilt = tilt_angles(e.record, robot)
    if e.mission.flight.controller != "pid" or e.window is None:
        return
    searching = (t >= e.window.start) & (t <= e.window.end)
    limit = airframe(e.mission.flight.airframe).tilt_limit
    at_limit = tilt[searching] >= limit - _TILT_SLACK
    if not searching.any() or at_limit.mean() <= _SHARE or at_limit.sum() < _WEAK_SAMPLES:
        return
    yield Finding(
        Level.WARN,
        "saturation",
        f"{robot} tilted as far as its controller may ({math.degrees(limit):.0f}°) for {at_limit.mean() * 100:.0f} % "
        "of the search",
        "lower limits.acceleration and limits.speed, or fly with controller: mellinger",
        (robot,),
        float(t[searching][at_limit][0]),
        cause=True,
    )
