"""The shortest way of one robot around what is in the way: A* on corners of prisms, at heights that matter.

Corners lie just outside of what they belong to, so ways along the sides are clear of it. Moves are level, straight up
or down, or straight from the first to the last point. Every corner costs a stop, so a way with fewer of them is
preferred to one that is a little shorter.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.transfer.scene import ROOM, Scene

STOP = 0.3  # [m] of way that a stop is worth: what is flown in the second it takes
_SIDES = 8  # corners of the ways around a robot that hovers
_SAME = 1e-9  # [m]


def find_path(
    scene: Scene, robot: int, begin: Array, goal: Array, others: Sequence[int] = (), where: Array | None = None
) -> Array | None:
    """Points (K, 3) to fly through after ``begin``, the goal last; None if there is no way.

    Args:
        scene: the surroundings.
        robot: who flies.
        begin: (3,) from where [m].
        goal: (3,) where to [m].
        others: (K,) robots that hover in the way; one may be at several places.
        where: (K, 3) where they hover [m].
    """
    places = np.zeros((0, 3)) if where is None else where
    points = _points(scene, robot, begin, goal, others, places)

    def clear(k: int, to: NDArray[np.intp]) -> NDArray[np.bool_]:
        blocked, _ = scene.blocked_by(robot, points[k], points[to])
        return ~(blocked | scene.near(robot, points[k], points[to], others, places))

    # A*: point 0 is the beginning, point 1 the goal; what is in ``cost`` is the length of the best way so far.
    cost, before = np.full(len(points), math.inf), np.zeros(len(points), dtype=np.intp)
    closed = np.zeros(len(points), dtype=np.bool_)
    ahead = np.linalg.norm(points - goal, axis=1)
    cost[0] = 0.0
    queue = [(float(ahead[0]), 0)]
    while queue:
        _, k = heapq.heappop(queue)
        if k == 1:
            return points[_trace(before)]
        if closed[k]:
            continue
        closed[k] = True
        to = _neighbours(points, k, closed)
        length = cost[k] + np.linalg.norm(points[to] - points[k], axis=1) + STOP
        to, length = to[length < cost[to]], length[length < cost[to]]
        free = clear(k, to) if len(to) else np.zeros(0, dtype=np.bool_)
        for node, value in zip(to[free].tolist(), length[free].tolist(), strict=True):
            cost[node], before[node] = value, k
            heapq.heappush(queue, (value + float(ahead[node]), node))
    return None


def _trace(before: NDArray[np.intp]) -> list[int]:
    way = [1]
    while before[way[-1]] != 0:
        way.append(int(before[way[-1]]))
    return way[::-1]


def _neighbours(points: Array, k: int, closed: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Points on the same level or in the same column; the goal from the beginning."""
    level = np.abs(points[:, 2] - points[k, 2]) < _SAME
    column = (np.abs(points[:, :2] - points[k, :2]) < _SAME).all(axis=1)
    follow = (level | column) & ~closed
    if k == 0:
        follow[1] = True
    return np.flatnonzero(follow)


def _points(scene: Scene, robot: int, begin: Array, goal: Array, others: Sequence[int], places: Array) -> Array:
    """(K, 3) points a way may turn at: beginning, goal, and corners at all heights that matter, inside the fence."""
    aside = [begin[None, :2], goal[None, :2], *(prism.corners for prism in scene.prisms[robot])]
    heights = {float(begin[2]), float(goal[2]), *(z for prism in scene.prisms[robot] for z in prism.heights)}
    for k, place in zip(others, places, strict=True):
        keep = scene.least[robot, k]
        aside.append(place[:2] + _around((keep + ROOM / 10.0) / math.cos(math.pi / _SIDES)))
        if scene.scale[2] > 0.0:
            reach = (keep + ROOM / 10.0) / scene.scale[2]
            heights |= {float(place[2] + reach), float(place[2] - reach)}
    corners = np.concatenate(aside)
    grid = [np.column_stack([corners, np.full(len(corners), z)]) for z in sorted(heights)]
    points = np.concatenate(grid)
    inside = ((points >= scene.lower - _SAME) & (points <= scene.upper + _SAME)).all(axis=1)
    points = points[inside & _free(scene, robot, points, others, places)]
    return np.concatenate([begin[None], goal[None], points])


def _free(scene: Scene, robot: int, points: Array, others: Sequence[int], places: Array) -> NDArray[np.bool_]:
    free = np.ones(len(points), dtype=np.bool_)
    for prism in scene.prisms[robot]:
        free &= (points @ prism.normals.T >= prism.offsets).any(axis=1)
    for k, place in zip(others, places, strict=True):
        free &= np.linalg.norm((points - place) * scene.scale, axis=1) >= scene.least[robot, k]
    return free


def _around(radius: float) -> Array:
    angle = np.arange(_SIDES) * (2.0 * math.pi / _SIDES)
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def length(points: Sequence[Array]) -> float:
    """Length of a way through points (3,) [m]."""
    return sum(math.dist(a, b) for a, b in itertools.pairwise(points))
