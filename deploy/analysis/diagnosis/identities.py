"""Robots that motion capture took for one another, and poses that nobody can have flown."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from deploy.analysis.evidence import Evidence
from deploy.analysis.findings import Finding, Level
from missions.arrays import Array

_FASTEST = 6.0  # m/s that no Crazyflie flies
_JUMP = 0.12  # m below which a jump is noise
_SAME = 0.4  # of the jump: how near to the other's place it has to lead
_TOGETHER = 0.15  # s within which both of a pair jump
_BACK = 1.0  # s after which an outlier is none any more
_EXCHANGED, _APART = 0.1, 0.3  # m: on the other's trajectory, and not on one's own
_LASTING = 0.5  # of the samples of the search
_KEPT_BACK = {  # by what the gate calls it (mocap.gate.Incident)
    "swap": "marker swap",
    "teleport": "pose outlier",
    "jump": "frame alignment",
    "frozen": "frozen pose",
    "attitude": "pose outlier",
}
_CLEAN = "cover what reflects, mask it in the cameras, or mount markers that cannot be mistaken"
_REMEDY = "use markers or rigid bodies that differ more, keep robots further apart, or let ergoflie track markers"


class Jump(NamedTuple):
    """A robot was seen at ``a`` [m], and the next moment, t [s], at ``b`` [m]."""

    robot: str
    t: float
    a: Array
    b: Array

    @property
    def length(self) -> float:
        """[m]."""
        return float(np.linalg.norm(self.b - self.a))


def identities(e: Evidence) -> Iterator[Finding]:
    """What was noticed in flight, then swaps, what only jumped, and robots that flew each other's trajectories."""
    yield from _noticed(e)
    jumps = [jump for name in e.names for jump in _jumps(e, name)]
    swapped: set[str] = set()
    for one, other in itertools.combinations(jumps, 2):
        if one.robot != other.robot and not swapped & {one.robot, other.robot} and _crossed(one, other):
            swapped |= {one.robot, other.robot}
            text = f"motion capture took {one.robot} and {other.robot} for each other {e.when(one.t)}"
            yield Finding(Level.FAIL, "marker swap", text, _REMEDY, (one.robot, other.robot), one.t, cause=True)
    yield from _outliers(e, [jump for jump in jumps if jump.robot not in swapped])
    yield from _exchanged(e)


def _noticed(e: Evidence) -> Iterator[Finding]:
    """What the gate kept from the drones (``mocap.gate``): the poses in the log are what was left. Each kind once."""
    told: set[tuple[str, str]] = set()
    for event in e.record.events:
        name = _KEPT_BACK.get(event.kind)
        if event.name != "mocap" or name is None or (name, event.robot) in told:
            continue
        told.add((name, event.robot))
        who = f"{event.robot}: " if event.robot else ""
        robots = tuple(robot for robot in event.robot.split("–") if robot)
        text, level = f"{who}{event.text}, {e.when(event.t)}", Level.FAIL if name == "marker swap" else Level.WARN
        yield Finding(level, name, text, _REMEDY if name == "marker swap" else _CLEAN, robots, event.t, cause=True)


def _jumps(e: Evidence, robot: str) -> list[Jump]:
    series = e.record.of(robot, "pose")
    if series is None or len(series) < 2:
        return []
    q, t = series["position"], series.t
    step, dt = np.linalg.norm(np.diff(q, axis=0), axis=1), np.diff(t)
    far = np.flatnonzero(step > np.maximum(_JUMP, _FASTEST * dt))
    return [Jump(robot, float(t[k + 1]), q[k], q[k + 1]) for k in far]


def _crossed(one: Jump, other: Jump) -> bool:
    """Whether each jumped to where the other had been."""
    if abs(one.t - other.t) > _TOGETHER:
        return False
    near = _SAME * min(one.length, other.length)
    return bool(np.linalg.norm(one.b - other.a) < near and np.linalg.norm(other.b - one.a) < near)


def _outliers(e: Evidence, jumps: Sequence[Jump]) -> Iterator[Finding]:
    for robot, group in itertools.groupby(jumps, key=lambda jump: jump.robot):
        mine = list(group)
        first = mine[0]
        back = next((jump for jump in mine[1:] if jump.t - first.t < _BACK), None)
        lasted = f" for {back.t - first.t:.2f} s" if back else ""
        more = f"; {len(mine)} such jumps in all" if len(mine) > 2 else ""
        text = f"motion capture showed {robot} {first.length:.2f} m beside itself{lasted}, {e.when(first.t)}{more}"
        yield Finding(Level.WARN, "pose outlier", text, _CLEAN, (robot,), first.t, cause=True)


def _exchanged(e: Evidence) -> Iterator[Finding]:
    for a, b in itertools.combinations(e.tracking, 2):
        at_a, at_b = a.reference + a.deviation, b.reference + b.deviation
        with np.errstate(invalid="ignore"):
            crossed = (np.linalg.norm(at_a - b.reference, axis=1) < _EXCHANGED) & (
                np.linalg.norm(at_b - a.reference, axis=1) < _EXCHANGED
            )
            own = (a.error > _APART) & (b.error > _APART)
        if len(own) and (crossed & own).mean() > _LASTING:
            text = f"{a.robot} and {b.robot} flew each other's trajectories"
            remedy = "swap their URIs, their rigid bodies' names, or the drones on their pads"
            yield Finding(Level.FAIL, "exchanged robots", text, remedy, (a.robot, b.robot), cause=True)
