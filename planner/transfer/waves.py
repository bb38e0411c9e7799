"""Who moves when: everybody at once where that is safe, else in waves.

In a wave some robots move, straight and for the same time, and the others hover. Robots that share their progress keep
distance vectors that are linear in it, so whether a wave is safe is known in closed form. A wave takes whoever can come
along; nobody stops for good where he would block somebody who still has to pass, unless there is no other way; and
who cannot go on finds a new way around those that hover, or else somebody makes room.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.transfer.errors import TransferError
from planner.transfer.paths import STOP, find_path, length
from planner.transfer.scene import Scene, closest

_GRID = 0.2  # [m] between places looked at by who makes room
_MOST_TRIED = 3  # of the places where he would be in nobody's way
_BESIDE = 1.0  # [m] from a way: farther places are not looked at when it is bent
_ENOUGH = 2  # orders that work out, of which the fastest is flown
_MOST_WAVES = 6  # for each robot; more means that robots chase each other around


def together(scene: Scene, begin: Array, goal: Array) -> bool:
    """Whether everybody may fly straight from (N, 3) to (N, 3) [m] at once, sharing the progress."""
    direct = (not scene.blocked_by(k, begin[k], goal[k : k + 1])[0][0] for k in range(len(begin)))
    return all(direct) and not any(scene.clash(begin, goal, goal[k], k) for k in range(len(begin)))


def ways_around(scene: Scene, begin: Array, goal: Array) -> list[list[Array]]:
    """Points (3,) to fly through to the goal, by robot, as if all others were elsewhere; none for who is there.

    Raises:
        TransferError: something is in a robot's way and there is no way around it.
    """
    return [_way_around_things(scene, k, begin[k], goal[k]) for k in range(len(begin))]


def ways_past_all(scene: Scene, begin: Array, goal: Array, around: Sequence[Sequence[Array]]) -> list[list[Array]]:
    """As :func:`ways_around`, but past where others begin and end as well, for those who find such a way."""
    ways = [list(way) for way in around]
    for k, way in enumerate(ways):
        others = [j for j in range(len(begin)) if j != k]
        where = np.concatenate([begin[others], goal[others]])
        twice = others + others
        route = [begin[k], *way]
        if not any(scene.near(k, a, b[None], twice, where)[0] for a, b in itertools.pairwise(route)):
            continue
        away = np.min([closest(a - where, b - where) for a, b in itertools.pairwise(route)], axis=0)
        past = [n for n in np.flatnonzero(away < _BESIDE) if _avoidable(scene, k, twice[n], where[n], begin, goal)]
        found = find_path(scene, k, begin[k], goal[k], [twice[n] for n in past], where[past])
        ways[k] = list(found) if found is not None else way
    return ways


def _avoidable(scene: Scene, robot: int, other: int, place: Array, begin: Array, goal: Array) -> bool:
    """Whether another robot's place is not so close to a robot's own beginning or goal that it has to be passed."""
    own = np.stack([begin[robot], goal[robot]])
    return bool((np.linalg.norm((own - place) * scene.scale, axis=1) >= scene.least[robot, other]).all())


def waves(scene: Scene, begin: Array, goal: Array, ways: Sequence[Sequence[Array]]) -> list[Array]:
    """Where everybody hovers after each wave.

    Args:
        scene: the surroundings.
        begin: (N, 3) where everybody hovers [m].
        goal: (N, 3) where everybody goes [m].
        ways: as :func:`ways_around` has them.

    Returns:
        (N, 3) points [m], one array a wave, the last one equal to ``goal``.

    Raises:
        TransferError: no safe way was found; names the robot and what is in its way.
    """
    farthest = sorted(range(len(begin)), key=lambda k: -length([begin[k], *ways[k]]))
    found: list[list[Array]] = []
    failures: list[TransferError] = []
    for order in (farthest, farthest[::-1], range(len(begin))):
        if len(found) == _ENOUGH:
            break
        try:
            found.append(_Crossing(scene, begin, goal, ways, order).fly())
        except TransferError as error:
            failures.append(error)
    if not found:
        raise failures[0]
    return min(found, key=lambda flown: _lasting(begin, flown))


def _lasting(begin: Array, flown: Sequence[Array]) -> float:
    """How long waves last, in metres of their longest moves; a wave costs a stop."""
    return sum(STOP + float(np.linalg.norm(b - a, axis=1).max()) for a, b in itertools.pairwise([begin, *flown]))


def _way_around_things(scene: Scene, robot: int, begin: Array, goal: Array) -> list[Array]:
    if np.array_equal(begin, goal):
        return []
    way = find_path(scene, robot, begin, goal)
    if way is None:
        _, thing = scene.blocked_by(robot, begin, goal[None])
        raise TransferError(
            f"{scene.names[robot]}: {thing} is in the way from {_show(begin)} to {_show(goal)} and there is no way "
            "around it inside the geofence"
        )
    return list(way)


class _Crossing:
    """Waves in the making.

    Args:
        scene: the surroundings.
        begin: (N, 3) [m]. goal: (N, 3) [m].
        ways: points that are left to fly through, by robot.
        order: who is asked first whether he can come along.
    """

    def __init__(
        self, scene: Scene, begin: Array, goal: Array, ways: Sequence[Sequence[Array]], order: Iterable[int]
    ) -> None:
        self._scene, self._goal, self._order = scene, goal, list(order)
        self._here = begin.copy()
        self._ways = [list(way) for way in ways]
        self._aside = [False] * len(self._ways)  # who has made room; once is enough

    def fly(self) -> list[Array]:
        """All waves. Raises TransferError."""
        flown: list[Array] = []
        while any(self._ways):
            movers = self._movers(polite=True) or self._make_room() or self._movers(polite=False) or self._detour()
            if not movers or len(flown) >= _MOST_WAVES * len(self._order):
                raise TransferError(self._stuck())
            for k in movers:
                self._here[k] = self._ways[k].pop(0)
            flown.append(self._here.copy())
        return flown

    def _movers(self, *, polite: bool) -> list[int]:
        """Who moves in the next wave; with ``polite``, nobody stops for good in somebody's way."""
        movers: list[int] = []
        there = self._here.copy()
        added = True
        while added:
            added = False
            for k in self._order:
                if k in movers or not self._ways[k] or self._scene.clash(self._here, there, self._ways[k][0], k):
                    continue
                if polite and len(self._ways[k]) == 1 and self._in_the_way(k, movers):
                    continue
                movers.append(k)
                there[k], added = self._ways[k][0], True
        return movers

    def _in_the_way(self, robot: int, movers: Sequence[int]) -> bool:
        """Whether somebody who still has to pass would come too close to a robot that has arrived."""
        for k, way in enumerate(self._ways):
            left = [self._here[k], *way] if k not in movers else way  # movers fly their next point now
            if k == robot or len(left) < 2:
                continue
            if self._comes_by(k, left, robot, self._goal[robot][None])[0]:
                return True
        return False

    def _detour(self) -> list[int]:
        """New ways around those that hover, for the first who finds one."""
        for k in self._order:
            if not self._ways[k]:
                continue
            others = [j for j in range(len(self._goal)) if j != k]
            way = find_path(self._scene, k, self._here[k], self._goal[k], others, self._here[others])
            if way is not None:
                self._ways[k] = list(way)
                return [k]
        return []

    def _make_room(self) -> list[int]:
        """One in whose way somebody is stuck moves to the nearest place where he is in nobody's."""
        for k in self._order:
            others = [j for j in range(len(self._goal)) if j != k]
            if self._aside[k] or not any(self._comes_by(j, self._left(j), k, self._here[k][None])[0] for j in others):
                continue
            places = self._places(k)
            free = ~self._scene.blocked_by(k, self._here[k], places)[0]
            free &= ~self._scene.near(k, self._here[k], places, others, self._here[others])
            for j in others:
                free &= ~self._comes_by(j, self._left(j), k, places)
            for place in places[free][:_MOST_TRIED]:
                way = find_path(self._scene, k, place, self._goal[k])
                if way is not None:
                    self._ways[k], self._aside[k] = [place, *way], True
                    return [k]
        return []

    def _left(self, robot: int) -> list[Array]:
        return [self._here[robot], *self._ways[robot]]

    def _places(self, robot: int) -> Array:
        """(K, 3) places at a robot's height all over the fence, the nearest first."""
        lower, upper = self._scene.lower, self._scene.upper
        steps = [np.linspace(lower[a], upper[a], 1 + math.ceil((upper[a] - lower[a]) / _GRID)) for a in (0, 1)]
        x, y = np.meshgrid(*steps)
        places = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, self._here[robot, 2])])
        away = np.linalg.norm(places - self._here[robot], axis=1)
        return np.asarray(places[np.argsort(away, kind="stable")])

    def _comes_by(self, robot: int, way: Sequence[Array], other: int, places: Array) -> NDArray[np.bool_]:
        """(K,) whether a robot's way through points (3,) comes too close to another one hovering at places (K, 3)."""
        near = np.zeros(len(places), dtype=np.bool_)
        for a, b in itertools.pairwise(way):
            apart = closest((a - places) * self._scene.scale, (b - places) * self._scene.scale)
            near |= apart < self._scene.least[robot, other]
        return near

    def _stuck(self) -> str:
        k = next(k for k in self._order if self._ways[k])
        others = [j for j in range(len(self._goal)) if j != k]
        begin, end = self._here[k], self._ways[k][0]
        near = [j for j in others if self._scene.near(k, begin, end[None], [j], self._here[[j]])[0]]
        who = ", ".join(self._scene.names[j] for j in near) or "somebody"
        return (
            f"{self._scene.names[k]}: {who} hovers in the way from {_show(begin)} to {_show(self._goal[k])} and nobody "
            "can make room"
        )


def _show(point: Array) -> str:
    return "(" + ", ".join(f"{value:.2f}" for value in point) + ")"
