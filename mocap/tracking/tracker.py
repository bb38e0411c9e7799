"""Which unlabelled marker is which robot: identity from the pads, then from how everybody moves.

A robot is *tracked* while its marker is seen where its motion predicts it. In every frame the points are assigned to
all tracked robots at once, with the likelihood of everything together at its greatest:

    cost = −log( p_D N(z; p, S) / ((1 − p_D) λ) )

for robot and point, and 0 for a robot without a point and a point without a robot (Reid, An Algorithm for Tracking
Multiple Targets, IEEE TAC 1979, eq. 16, of one scan).

Otherwise it is *sought*: on its pad before it was ever seen, or wherever its motion, and its reference if it has one,
may have taken it since. Points that are nobody's are followed without names (``tracklets.py``); when such a marker has
a velocity, its place and velocity are compared with what is predicted of everybody who is sought, again all at once.
That comparison is made once: a constant-velocity motion has no memory, so whatever two markers do *after* they
reappeared says nothing about who they were when they did; waiting until predictions have drifted apart would only look
like it.

To say nothing is better than to say something wrong: another robot's pose makes a drone fly away, a missing one makes
its flight land. Nothing is said of a robot whose marker could as well be another's. Drones get markers as measured;
filtering is their own business.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from mocap.tracking.assignment import assign
from mocap.tracking.motion import Motion
from mocap.tracking.settings import Settings
from mocap.tracking.tracklets import Tracklet, Tracklets

Vec3 = tuple[float, float, float]
Reference = Callable[[str, float], Vec3 | None]
# Of the velocities of false points: most stand still. Density 1/(2 m/s)³.
_GHOST_VELOCITIES = 0.125


@dataclass(frozen=True)
class Seen:
    """What a frame said.

    Attributes:
        positions: of the tracked robots that were seen in it [m].
        ambiguous: robots of whom nothing was said because a marker could be theirs or another's.
        ghosts: points that are nobody's, or nobody knows whose.
    """

    positions: Mapping[str, Vec3]
    ambiguous: tuple[str, ...]
    ghosts: int


class Tracker:
    """The identities of a swarm.

    Args:
        pads: where each robot's marker is when it stands on its pad [m].
        settings: of markers and motion.
        reference: where a robot should be at a time [m], None if unknown; tells apart who cannot be told by motion.
    """

    def __init__(
        self, pads: Mapping[str, Vec3], settings: Settings | None = None, reference: Reference | None = None
    ) -> None:
        self._settings = s = settings or Settings()
        self._names, self._reference = tuple(pads), reference
        self._pads = np.array([pads[name] for name in self._names], dtype=np.float64).reshape(-1, 3)
        self._deviation = min(s.pad, 0.5 * _least_distance(self._pads)) / s.gate
        self._motion = Motion(self._pads, self._deviation, s.agility)
        n = len(self._names)
        self._tracked = np.zeros(n, dtype=bool)
        self._standing = np.ones(n, dtype=bool)  # sought on their pads
        self._lost_track = np.zeros(n, dtype=bool)  # their motion says nothing any more
        self._seen_at = np.full(n, -math.inf)
        self._tracklets = Tracklets(s)
        self._t = -math.inf

    @property
    def tracked(self) -> tuple[str, ...]:
        """Robots whose markers are known."""
        return tuple(name for name, known in zip(self._names, self._tracked, strict=True) if known)

    def update(self, t: float, points: Sequence[Vec3]) -> Seen:
        """Take a frame.

        Args:
            t: time of the measurement [s]; a frame that is not newer than the one before is ignored.
            points: markers in any order, world frame [m]; those that are not finite are ignored.
        """
        if t <= self._t:
            return Seen({}, (), 0)
        if self._t > -math.inf:
            self._motion.predict(t - self._t, ~self._standing)
        self._t = t
        self._demote(t)
        points = [point for point in points if all(map(math.isfinite, point))]
        positions, doubtful, rest = self._follow(t, points)
        for ended in self._tracklets.update(t, rest):
            self._give_up(ended)
        doubtful += self._recognise(t)
        return Seen(positions, tuple(dict.fromkeys(doubtful)), len(rest))

    # ------------------------------------------------------------------------------------------------ tracked

    def _follow(self, t: float, points: Sequence[Vec3]) -> tuple[dict[str, Vec3], list[str], list[Vec3]]:
        """Points of those who are tracked; whose are in doubt; and the points that are left over."""
        rows = np.flatnonzero(self._tracked)
        if not len(rows) or not points:
            return {}, [], list(points)
        s, z = self._settings, np.array(points)
        variance = self._motion.pp[rows] + s.noise**2
        squared = ((z[None] - self._motion.position[rows][:, None]) ** 2).sum(axis=2)
        density = s.detection / ((1.0 - s.detection) * s.ghosts) / (2.0 * math.pi * variance) ** 1.5
        cost = 0.5 * squared / variance[:, None] - np.log(density)[:, None]
        cost[squared > np.minimum(s.gate**2 * variance, s.reach**2)[:, None]] = math.inf
        positions, doubtful, used = {}, [], set()
        for match in assign(cost):
            i, point = int(rows[match.row]), points[match.column]
            if match.contested < s.margin:
                doubtful.append(self._names[i])
                continue
            used.add(match.column)
            self._motion.correct(i, z[match.column], s.noise**2)
            self._seen_at[i] = t
            positions[self._names[i]] = point
        return positions, doubtful, [point for j, point in enumerate(points) if j not in used]

    def _demote(self, t: float) -> None:
        """Those not seen for a while are sought, first where they may be, at last on the pad if that is near."""
        s, unseen = self._settings, t - self._seen_at
        self._tracked &= unseen <= s.coasting
        for i in np.flatnonzero(~self._tracked & ~self._standing & (unseen > s.forgotten)):
            self._lost_track[i] = True
            # Who was lost somewhere else may still fly, blind: what lies on its pad is somebody or something else.
            if math.dist(self._motion.position[i], self._pads[i]) <= s.reach:
                self._standing[i], self._lost_track[i] = True, False
                self._motion.restart(int(i), self._pads[i], np.zeros(3), (self._deviation, 0.0))
                for tracklet in self._tracklets.alive:
                    tracklet.costs.pop(int(i), None)

    # ------------------------------------------------------------------------------------------------ sought

    def _recognise(self, t: float) -> list[str]:
        """Give names to the markers that can be only one robot's; returns the robots that stay in doubt."""
        rows, mature = np.flatnonzero(~self._tracked), self._tracklets.mature
        if not len(rows) or not mature:
            return []
        cost = np.array([[self._cost(int(i), tracklet, t) for tracklet in mature] for i in rows])
        doubtful = []
        for match in assign(cost):
            i, tracklet = int(rows[match.row]), mature[match.column]
            seen, place = tracklet.last
            # A marker beyond reach still counts when others are compared with it: whose it is not, it may well be.
            if match.margin < self._settings.margin or not self._within_reach(i, place):
                doubtful.append(self._names[i])
                continue
            deviations = (self._settings.noise, self._velocity_deviation(tracklet))
            self._motion.restart(i, np.array(place), np.array(tracklet.velocity), deviations)
            self._tracked[i], self._standing[i], self._lost_track[i], self._seen_at[i] = True, False, False, seen
            self._tracklets.remove(tracklet)
            for other in self._tracklets.alive:
                other.costs.pop(i, None)
        return doubtful

    def _cost(self, i: int, tracklet: Tracklet, t: float) -> float:
        """Of a robot being a marker, against both being somebody else; infinite if it cannot be."""
        if i not in tracklet.costs:
            tracklet.costs[i] = math.inf if self._lost_track[i] else self._motion_cost(i, tracklet)
        return tracklet.costs[i] + self._reference_cost(i, tracklet, t)

    def _motion_cost(self, i: int, tracklet: Tracklet) -> float:
        """The same by place and velocity, both predicted for now."""
        s, m = self._settings, self._motion
        pp, vv = m.pp[i] + s.noise**2, m.vv[i] + self._velocity_deviation(tracklet) ** 2
        pv = m.pv[i]
        p, v = np.array(tracklet.last[1]) - m.position[i], np.array(tracklet.velocity) - m.velocity[i]
        determinant = pp * vv - pv * pv
        squared = float((vv * (p @ p) - 2.0 * pv * (p @ v) + pp * (v @ v)) / determinant)
        if squared > s.gate**2 + 10.0:  # six degrees of freedom instead of three
            return math.inf
        normal = -0.5 * squared - 1.5 * math.log(determinant) - 3.0 * math.log(2.0 * math.pi)
        return -normal - math.log(s.detection / ((1.0 - s.detection) * s.ghosts * _GHOST_VELOCITIES))

    def _reference_cost(self, i: int, tracklet: Tracklet, t: float) -> float:
        """What the reference adds, if there is one: half of chi² of the place."""
        reference = None if self._reference is None else self._reference(self._names[i], t)
        if reference is None or self._standing[i]:
            return 0.0
        squared = (math.dist(reference, tracklet.last[1]) / self._settings.reference) ** 2
        return 0.5 * min(squared, self._settings.gate**2)  # bounded: who is far off course is somewhere all the same

    def _within_reach(self, i: int, place: Vec3) -> bool:
        """Whether a marker is where a robot may be looked for."""
        return math.dist(place, self._motion.position[i]) <= self._settings.reach

    def _velocity_deviation(self, tracklet: Tracklet) -> float:
        """Of a tracklet's velocity per axis [m/s]: its ends' noise, and what changed since the middle of its span."""
        s, span = self._settings, tracklet.span
        return math.sqrt(2.0 * (s.noise / span) ** 2 + s.agility * span / 3.0)

    def _give_up(self, ended: Tracklet) -> None:
        """Those who were in doubt about a marker that is gone: their motion does not say any more who is who."""
        doubtful = [
            i for i, cost in ended.costs.items() if cost < 0.0 and not self._tracked[i] and not self._standing[i]
        ]
        if len(doubtful) > 1:
            self._lost_track[doubtful] = True


def _least_distance(points: Array) -> float:
    if len(points) < 2:
        return math.inf
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    return float(apart[~np.eye(len(points), dtype=bool)].min())
