"""Where everybody comes to a stop, so that nobody meets anybody; no I/O.

Everybody brakes at once and in the same time T, each along his own trajectory: whoever slows down evenly stops where
he would have been T/2 later. Seen from the plan all stop at the same moment, so they hover as far apart as it has
them then, and on the way they stay near what was certified.

Whoever comes to rest within T anyway does so as it was certified: braking longer would carry him past his end.

Some cannot be told: they fly on. Whoever would come too close to one of them, or to anybody, waits elsewhere: at
another height if that is enough, else aside; where most is gained first, then in the order of the mission, so that the
same situation has the same answer.

The firmware flies from any state to rest along (planner.c, ``plan_go_to``; seventh degree, no jerk at either end)::

    p(s) = p₀ + (p₁ − p₀) (35 s⁴ − 84 s⁵ + 70 s⁶ − 20 s⁷) + v₀ T (s − 20 s⁴ + 45 s⁵ − 36 s⁶ + 10 s⁷)
              + a₀ T² (½ s² − 5 s⁴ + 10 s⁵ − 7½ s⁶ + 2 s⁷),    s = t/T
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from missions import fleet
from missions.arrays import Array
from missions.schema import Mission
from planner.transfer.scene import FENCE_SHARE

Vec3 = tuple[float, float, float]
DECELERATION = 1.0  # m/s², mean
SHORTEST, LONGEST = 0.6, 2.0  # s
_STEP = 0.05  # s between looks at who is near whom
_SHARES = (1.0, -1.0, 0.5, -0.5)  # of the vertical separation: other heights to wait at
_ASIDE = 1.2  # of the separation: how far aside
_SIDES = 8  # directions
_TOLERANCE = 1e-3  # m
_LOW = 0.25  # m above the ground: nobody waits lower

_POSITION = (0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0)  # of p₁ − p₀, ascending powers of s
_VELOCITY = (0.0, 1.0, 0.0, 0.0, -20.0, 45.0, -36.0, 10.0)  # of v₀ T
_ACCELERATION = (0.0, 0.0, 0.5, 0.0, -5.0, 10.0, -7.5, 2.0)  # of a₀ T²


@dataclass(frozen=True)
class Space:
    """How close anybody may come to anybody, and where.

    Attributes:
        separation: to keep [m]. scale: (3,) by how much distances count along each axis: downwash.
        lower, upper: corners of where one may wait [m].
    """

    separation: float
    scale: Array
    lower: Vec3
    upper: Vec3

    @classmethod
    def of(cls, mission: Mission, ground: float) -> Space:
        """As the mission has it; half of the fence's margin is for tracking. Ground: height of the pads [m]."""
        margin, (lower, upper) = FENCE_SHARE * mission.flight.geofence_margin, fleet.fence(mission)
        (x0, y0, _), (x1, y1, z1) = (lower - margin).tolist(), (upper + margin).tolist()
        scale = np.array([1.0, 1.0, fleet.transfer_scale(mission)])
        return cls(mission.limits.separation, scale, (x0, y0, ground + _LOW), (x1, y1, max(z1, ground + _LOW)))


@dataclass(frozen=True)
class Moving:
    """One drone in the air when everybody has to stop.

    Attributes:
        position, velocity, acceleration: what is asked of it now [m], [m/s], [m/s²].
        later: where it will be after so long [s] if it is told nothing [m].
        told: whether it can be told anything.
        left: for how long it goes on moving if it is told nothing [s].
    """

    position: Vec3
    velocity: Vec3
    acceleration: Vec3
    later: Callable[[float], Vec3]
    told: bool = True
    left: float = math.inf


@dataclass(frozen=True)
class Stops:
    """Where those who are told come to rest.

    Attributes:
        durations: of braking [s], by robot. targets: [m], by robot.
        moved: who waits elsewhere, and how far from where he would have stopped [m].
        apart: smallest distance of anybody to anybody until everybody could be down, vertical ones scaled [m].
    """

    durations: Mapping[str, float]
    targets: Mapping[str, Vec3]
    moved: Mapping[str, float]
    apart: float


def stop(
    drones: Mapping[str, Moving], space: Space, *, after: float, clear: Callable[[str, Vec3], bool] = lambda *_: True
) -> Stops:
    """Everybody to rest.

    Args:
        drones: who is in the air, in the mission's order.
        space: what to keep.
        after: how long those who stopped stay there, or above the ground there [s].
        clear: whether nothing of the mission is between a drone, by name, and a place where it would not fly by plan.
    """
    told = [drone for drone in drones.values() if drone.told]
    fastest = max((math.hypot(*drone.velocity) for drone in told), default=0.0)
    longest = min(LONGEST, max(SHORTEST, fastest / DECELERATION))
    t = np.arange(0.0, longest + after + _STEP, _STEP)  # (K,)
    courses = [_course(drone, longest, space) for drone in drones.values()]
    ways = np.stack([course.way(course.target, t) for course in courses] or [np.zeros((len(t), 3))])  # (N, K, 3)
    moved = _settle(list(drones), courses, ways, space, t, clear)
    told_to = {name: course for name, course in zip(drones, courses, strict=True) if course.drone.told}
    return Stops(
        {name: course.duration for name, course in told_to.items()},
        {name: course.target for name, course in told_to.items()},
        moved,
        float(_apart(ways, space).min(initial=math.inf)),
    )


def braking(position: Vec3, velocity: Vec3, acceleration: Vec3, target: Vec3, duration: float, t: Array) -> Array:
    """Where a drone is (K, 3) [m] at t (K,) [s] after it was told to be at rest at a target after ``duration`` [s]."""
    s = np.clip(t / duration, 0.0, 1.0)[:, None]
    p, v, a, goal = (np.array(x) for x in (position, velocity, acceleration, target))
    shares = [np.polynomial.polynomial.polyval(s, basis) for basis in (_POSITION, _VELOCITY, _ACCELERATION)]
    return np.asarray(p + shares[0] * (goal - p) + shares[1] * v * duration + shares[2] * a * duration**2)


# ---------------------------------------------------------------------------------------------------- inside


def _inside(target: Vec3, position: Vec3, space: Space) -> Vec3:
    """A target within the space; who is outside already is not told to go farther."""
    bounds = zip(target, position, space.lower, space.upper, strict=True)
    x, y, z = (min(max(goal, min(lo, p)), max(hi, p)) for goal, p, lo, hi in bounds)
    return x, y, z


@dataclass
class _Course:
    """How one drone is to stop: in how long [s], and where [m]."""

    drone: Moving
    duration: float
    target: Vec3

    def way(self, target: Vec3, t: Array) -> Array:
        """(K, 3) where it is at t (K,) [s] if that is its target."""
        d = self.drone
        if d.told:
            return braking(d.position, d.velocity, d.acceleration, target, self.duration, t)
        return np.array([d.later(float(moment)) for moment in t])


def _course(drone: Moving, longest: float, space: Space) -> _Course:
    ends = drone.left < longest
    duration = max(drone.left, SHORTEST) if ends else longest
    target = drone.later(drone.left if ends else 0.5 * duration)
    return _Course(drone, duration, _inside(target, drone.position, space))


def _apart(ways: Array, space: Space) -> Array:
    """(N, N) smallest distances of ways (N, K, 3), vertical ones scaled [m]; infinite to oneself."""
    scaled = ways * space.scale
    apart = np.stack([np.linalg.norm(scaled - way, axis=2).min(axis=1) for way in scaled])
    np.fill_diagonal(apart, np.inf)
    return apart


def _settle(
    names: Sequence[str],
    courses: Sequence[_Course],
    ways: Array,
    space: Space,
    t: Array,
    clear: Callable[[str, Vec3], bool],
) -> dict[str, float]:
    """Other places for those who would come too close to somebody; changes courses and ways."""
    moved: dict[str, float] = {}
    # Whoever is closer than allowed already cannot be asked for more than not to come closer.
    scaled = ways[:, 0] * space.scale
    now = np.linalg.norm(scaled[:, None] - scaled, axis=2)
    least = np.minimum(space.separation, now) - _TOLERANCE
    for _ in courses:
        missing = (least - _apart(ways, space)).max(axis=1)  # (N,) [m]
        gain, chosen = _TOLERANCE, None
        for k, (name, course) in enumerate(zip(names, courses, strict=True)):
            if not course.drone.told or name in moved or missing[k] <= 0.0:
                continue
            for target in _elsewhere(course.target, space):
                way = course.way(target, t)
                gained = round(float(missing[k]) - max(_missing(k, way, ways, least, space), 0.0), 6)
                if gained > gain and clear(name, target):
                    gain, chosen = gained, (k, target, way)
        if chosen is None:
            break
        k, target, ways[chosen[0]] = chosen
        moved[names[k]] = math.dist(target, courses[k].target)
        courses[k].target = target
    return moved


def _elsewhere(target: Vec3, space: Space) -> list[Vec3]:
    """Places to wait at instead, the better ones first."""
    (x, y, z), step = target, space.separation / float(space.scale[2])
    places = [(x, y, z + share * step) for share in _SHARES]
    for k in range(_SIDES):
        angle, reach = 2.0 * math.pi * k / _SIDES, _ASIDE * space.separation
        places.append((x + reach * math.cos(angle), y + reach * math.sin(angle), z))
    inside = dict.fromkeys(_inside(place, target, space) for place in places)
    return [place for place in inside if math.dist(place, target) > _TOLERANCE]


def _missing(k: int, way: Array, ways: Array, least: Array, space: Space) -> float:
    """By how much one on another way (K, 3) would be too close to somebody [m]; negative: nobody."""
    apart = np.linalg.norm((ways - way) * space.scale, axis=2).min(axis=1)
    apart[k] = np.inf
    return float((least[k] - apart).max())
