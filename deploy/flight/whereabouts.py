"""Where everybody is, as well as it is known, and where those will be who cannot be told anything."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from deploy.clock import Clock
from deploy.flight.courses import Courses
from deploy.flight.poses import Poses
from deploy.flight.seen import POSE_OLD
from deploy.radio.fleet import Fleet

Vec3 = tuple[float, float, float]
_ABOVE = 0.1  # m above the ground: whoever is higher flies


class Whereabouts:
    """The places of a flight.

    Args:
        fleet: who flies. poses: where they were seen. courses: where they should be. clock: the flight's.

    Attributes:
        ground: height of the pads [m].
    """

    def __init__(self, fleet: Fleet, poses: Poses, courses: Courses, clock: Clock) -> None:
        self._fleet, self._poses, self._courses, self._clock = fleet, poses, courses, clock
        self.ground = 0.0

    @property
    def alive(self) -> tuple[str, ...]:
        """Drones whose link is up."""
        return tuple(name for name, drone in self._fleet.items() if drone.connected)

    def position(self, robot: str) -> Vec3 | None:
        """Where a robot is [m], if it was ever seen; by its own word while motion capture does not see it."""
        located, estimate = self._poses.located(robot), self._fleet[robot].estimate
        if located is None:
            return None
        unseen = self._clock.now() - located.t > POSE_OLD
        return estimate.position if unseen and estimate and estimate.t > located.t + POSE_OLD else located.pose.position

    def positions(self) -> dict[str, Vec3]:
        """Where everybody is [m] who was ever seen."""
        return {name: position for name in self._fleet if (position := self.position(name)) is not None}

    def strays(self) -> dict[str, Callable[[float], Vec3]]:
        """Who flies and cannot be told anything: where each will be so many seconds from now [m], as far as known.

        Whoever is lost in the search flies it to its end and hovers there.
        """
        return {
            name: partial(self._astray, name, self._clock.now())
            for name, drone in self._fleet.items()
            if not drone.connected and (position := self.position(name)) and position[2] > self.ground + _ABOVE
        }

    def note_ground(self) -> None:
        """Remember the height of the pads: where the drones stand now."""
        self.ground = min((position[2] for position in self.positions().values()), default=0.0)

    def _astray(self, name: str, now: float, later: float) -> Vec3:
        located = self._poses.located(name)
        then = self._courses.at(name, now if located is None else located.t)
        there = self._courses.at(name, now + later)
        if located is None or then is None or there is None:
            return self.position(name) or self._courses.start(name)
        x, y, z = (p + b - a for p, a, b in zip(located.pose.position, then, there, strict=True))
        return x, y, z
