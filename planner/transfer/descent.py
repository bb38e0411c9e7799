"""Where to come down early: in place where nothing is below, else aside, at the nearest clear place.

After an abort robots hover anywhere. Who has an obstacle, a keep-out zone or another robot below him flies aside first;
the others stay where they are.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from missions import fleet
from missions.airframes import airframe
from missions.arrays import Array
from missions.schema import Mission
from planner.transfer.errors import TransferError
from planner.transfer.plan import plan_moves
from planner.transfer.scene import ROOM, Scene, survey
from planner.transfers import Passage

_SIDES = 12  # places looked at around a robot that is in the way


def clear_descents(
    mission: Mission, positions: Mapping[str, tuple[float, float, float]], able: Collection[str]
) -> Passage:
    """Moves that bring everybody over a place where he can land; none if everybody can land where he is.

    Args:
        mission: what may be below.
        positions: where robots are [m], those on the ground and those who cannot be told to move among them.
        able: who hovers and can be told to move.

    Raises:
        TransferError: somebody has something below him and no clear place, or no way to it.
    """
    here = replace(mission, robots=tuple(robot for robot in mission.robots if robot.name in positions))
    begin = np.array([positions[robot.name] for robot in here.robots], dtype=np.float64).reshape(-1, 3)
    places = _Places(here, begin)
    movable = [k for k, robot in enumerate(here.robots) if robot.name in able]
    blocked = [k for k in movable if not places.clear_below(k, begin[k])]
    for k in sorted(set(movable) - set(blocked), key=lambda k: float(begin[k, 2])):  # the lower one lands first
        others = [j for j in range(len(begin)) if j != k and j not in blocked]
        if any(begin[j, 2] <= begin[k, 2] and places.below(begin[k], begin[j]) for j in others):
            blocked.append(k)
    if not blocked:
        return {}
    goal = begin.copy()
    taken = [j for j in range(len(begin)) if j not in blocked]
    for k in blocked:
        goal[k] = places.nearest(k, goal[taken])
        taken.append(k)
    return plan_moves(here, begin, goal, hurried=True)


def ways_home(mission: Mission, positions: Mapping[str, tuple[float, float, float]], able: Collection[str]) -> Passage:
    """Moves that bring everybody from anywhere to over his pad, at the height he has.

    Args:
        mission: whose pads, and what is in the way.
        positions: where robots are [m], those on the ground and those who cannot be told to move among them.
        able: who hovers and can be told to move.

    Raises:
        TransferError: somebody has no way, or stands where another one has to land.
    """
    here = replace(mission, robots=tuple(robot for robot in mission.robots if robot.name in positions))
    begin = np.array([positions[robot.name] for robot in here.robots], dtype=np.float64).reshape(-1, 3)
    goal = begin.copy()
    moving = [k for k, robot in enumerate(here.robots) if robot.name in able]
    goal[moving, :2] = fleet.pads(here)[moving]
    places = _Places(here, goal)
    for k in moving:
        below = [here.robots[j].name for j in range(len(goal)) if j != k and places.below(goal[k], goal[j])]
        if below:
            raise TransferError(f"{here.robots[k].name} has {', '.join(below)} in the way of its pad")
    return plan_moves(here, begin, goal, hurried=True)


def clear_way(mission: Mission, robot: str, begin: tuple[float, float, float], end: tuple[float, float, float]) -> bool:
    """Whether a robot's straight way from one point to another [m] is clear of obstacles and zones."""
    here = replace(mission, robots=tuple(item for item in mission.robots if item.name == robot))
    scene = survey(here, np.array([begin]), np.array([begin]), hurried=True)
    blocked, _ = scene.blocked_by(0, np.array(begin), np.array([end]))
    return not blocked[0]


class _Places:
    """Where robots can land.

    Args:
        mission: of the robots that are looked at.
        begin: (N, 3) where they are [m].
    """

    def __init__(self, mission: Mission, begin: Array) -> None:
        self._scene: Scene = survey(mission, begin, begin, hurried=True)
        self._names = [robot.name for robot in mission.robots]
        self._begin = begin
        # Two bodies and a little air: beside each other they land as they hover.
        self._apart = 2.0 * airframe(mission.flight.airframe).radius + ROOM

    def clear_below(self, robot: int, point: Array) -> bool:
        """Whether nothing of the mission is between a point (3,) and the floor."""
        blocked, _ = self._scene.blocked_by(robot, point, (point * np.array([1.0, 1.0, 0.0]))[None])
        return not blocked[0]

    def below(self, point: Array, other: Array) -> bool:
        """Whether a robot at one point would come down on one at another, (3,) each."""
        return math.dist(point[:2], other[:2]) < self._apart

    def nearest(self, robot: int, taken: Array) -> Array:
        """The nearest place (3,) at the robot's height with nothing below, away from those that are taken (K, 3)."""
        height, scene = self._begin[robot, 2], self._scene
        angle = np.arange(_SIDES) * (2.0 * math.pi / _SIDES)
        ring = (self._apart + ROOM) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        aside = [prism.corners for prism in scene.prisms[robot]] + [point[:2] + ring for point in taken]
        candidates = np.concatenate([self._begin[robot : robot + 1, :2], *aside])
        candidates = candidates[np.argsort(np.linalg.norm(candidates - self._begin[robot, :2], axis=1), kind="stable")]
        for x, y in candidates.tolist():
            point = np.array([x, y, height])
            inside = ((point[:2] >= scene.lower[:2]) & (point[:2] <= scene.upper[:2])).all()
            alone = not any(self.below(point, other) for other in taken)
            if inside and alone and self.clear_below(robot, point):
                return point
        raise TransferError(f"{self._names[robot]} has something below and no clear place to land within the geofence")
