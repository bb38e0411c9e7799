"""Points that are nobody's, followed from frame to frame until it is clear whose they are.

A tracklet links points that one marker can have made: no faster than ``Settings.speed`` at first, then with a velocity
that changes by no more than ``Settings.acceleration``. It knows no robots.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

from mocap.tracking.settings import Settings

Vec3 = tuple[float, float, float]


@dataclass(eq=False)
class Tracklet:
    """A marker without a name.

    Attributes:
        points: the last of them with their times [s], [m]; as many as make a velocity.
        count: how many there were.
        costs: by robot, against being nobody's; evaluated once, when the robot could first be it. What the marker does
            afterwards says nothing more about who it was then.
    """

    points: deque[tuple[float, Vec3]]
    count: int = 1
    costs: dict[int, float] = field(default_factory=dict)

    @property
    def last(self) -> tuple[float, Vec3]:
        """Time [s] and place [m] of the newest point."""
        return self.points[-1]

    @property
    def span(self) -> float:
        """Time over which the velocity is taken [s]; 0 with one point."""
        return self.points[-1][0] - self.points[0][0]

    @property
    def velocity(self) -> Vec3:
        """Mean velocity over the points that are remembered [m/s]; zero with one point."""
        (t0, a), (t1, b) = self.points[0], self.points[-1]
        dt = t1 - t0
        return ((b[0] - a[0]) / dt, (b[1] - a[1]) / dt, (b[2] - a[2]) / dt) if dt > 0.0 else (0.0, 0.0, 0.0)

    def add(self, t: float, point: Vec3) -> None:
        """One more point."""
        self.points.append((t, point))
        self.count += 1


class Tracklets:
    """All markers without names.

    Attributes:
        alive: those that were seen lately.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self.alive: list[Tracklet] = []

    @property
    def mature(self) -> list[Tracklet]:
        """Those followed long enough to have a velocity, and seen in the newest frame."""
        return [tracklet for tracklet in self.alive if tracklet.count >= self._settings.confirmation]

    def update(self, t: float, points: Sequence[Vec3]) -> list[Tracklet]:
        """Follow everybody to a new frame's points, nearest first; those left over begin anew.

        Returns:
            Tracklets that ended, not having been seen for ``Settings.coasting``.
        """
        pairs = sorted(
            (away, i, j)
            for i, tracklet in enumerate(self.alive)
            for j, point in enumerate(points)
            if (away := self._distance(tracklet, t, point)) < math.inf
        )
        followed: set[int] = set()
        used: set[int] = set()
        for _, i, j in pairs:
            if i not in followed and j not in used:
                followed.add(i)
                used.add(j)
                self.alive[i].add(t, points[j])
        ended = [tracklet for tracklet in self.alive if t - tracklet.last[0] > self._settings.coasting]
        self.alive = [tracklet for tracklet in self.alive if t - tracklet.last[0] <= self._settings.coasting]
        new = [point for j, point in enumerate(points) if j not in used]
        self.alive += [Tracklet(deque([(t, point)], maxlen=self._settings.confirmation)) for point in new]
        return ended

    def remove(self, tracklet: Tracklet) -> None:
        """It has a name now."""
        self.alive.remove(tracklet)

    def _distance(self, tracklet: Tracklet, t: float, point: Vec3) -> float:
        """How far a point is from where a tracklet should be [m]; infinite if it cannot be the same marker."""
        s, (t_last, last) = self._settings, tracklet.last
        dt, span, blur = t - t_last, tracklet.span, s.gate * s.noise
        if span == 0.0:
            away, allowed = math.dist(point, last), s.speed * dt + blur
        else:
            vx, vy, vz = tracklet.velocity
            away = math.dist(point, (last[0] + dt * vx, last[1] + dt * vy, last[2] + dt * vz))
            # The velocity is the mean over the span: half of that old, and as uncertain as its two ends.
            allowed = 0.5 * s.acceleration * dt * (dt + span) + blur * (1.0 + 2.0 * dt / span)
        return away if away <= allowed else math.inf
