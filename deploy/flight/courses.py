"""Where everybody should be: in the search by the certified bytes, on the way to it and back by the moves commanded."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from deploy.flight.reference import Reference, Vec3, Way
from planner.trajectory.encode import decode
from planner.trajectory.encoded import EncodedTrajectory
from planner.trajectory.timeline import Timeline


@dataclass
class Search:
    """The search, once it has begun: its start by flight clock [s], the spread of starts [s]."""

    start: float = math.nan
    skew: float = math.nan

    @property
    def begun(self) -> bool:
        """Whether trajectories were started."""
        return not math.isnan(self.start)


class Courses:
    """The ways of a flight, by robot.

    Args:
        trajectories: certified bytes, by robot.

    Attributes:
        references: certified trajectories, decoded from the bytes. timelines: where in them robots are.
        search: when it began. ways: moves outside the search that were commanded last.
    """

    def __init__(self, trajectories: Mapping[str, EncodedTrajectory]) -> None:
        self.references = {name: decode(encoded) for name, encoded in trajectories.items()}
        self.timelines = {name: Timeline.of(encoded) for name, encoded in trajectories.items()}
        self.search, self.ways = Search(), dict[str, Way]()
        self._points = {name: Reference(trajectory) for name, trajectory in self.references.items()}

    @property
    def duration(self) -> float:
        """Of the search [s]."""
        return max(reference.duration for reference in self.references.values())

    def forget(self, robot: str) -> None:
        """Who does not fly has no course."""
        for record in (self.references, self._points, self.timelines):
            record.pop(robot)

    def take_over(self, trajectories: Mapping[str, EncodedTrajectory]) -> None:
        """Other bytes, which begin with what has been flown, and whose legs begin when those of the old ones did."""
        for name in self.references:
            self.references[name] = decode(trajectories[name])
            self._points[name] = Reference(self.references[name])

    def start(self, robot: str) -> Vec3:
        """First point of a robot's trajectory [m]."""
        return self._points[robot].position(0.0)

    def yaw_at_start(self, robot: str) -> float:
        """Heading there [rad]."""
        return float(self.references[robot].evaluate(np.array([0.0]))[0, 3])

    def reference(self, robot: str, t: float) -> Vec3:
        """Where the certified trajectory is at a flight time after its start [m]."""
        return self._points[robot].position(self.timelines[robot].at(t))

    def velocity(self, robot: str, t: float) -> Vec3:
        """Velocity of the certified trajectory [m/s]; zero before and after it, and while a leg holds its end."""
        timeline = self.timelines[robot]
        return (0.0, 0.0, 0.0) if timeline.holds(t) else self._points[robot].velocity(timeline.at(t))

    def at(self, robot: str, t: float) -> Vec3 | None:
        """Where the last command leads a robot at a flight time [m]; None before any."""
        if self._searches(robot):
            return self.reference(robot, t)
        way = self.ways.get(robot)
        return None if way is None else way.position(t)

    def left(self, robot: str, now: float) -> float:
        """For how long a robot goes on moving if it is told nothing [s]."""
        if self._searches(robot):
            return max(0.0, self.search.start + self.references[robot].duration - now)
        way = self.ways.get(robot)
        return 0.0 if way is None else max(0.0, way.begun + way.duration - now)

    def _searches(self, robot: str) -> bool:
        """Whether its trajectory is the last thing a robot was told."""
        way = self.ways.get(robot)
        return self.search.begun and (way is None or way.begun <= self.search.start)
