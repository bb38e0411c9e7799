"""How close robots came to each other, to obstacles and to the fence."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from deploy.analysis.align import Motion
from missions.arrays import Array, frozen
from missions.fleet import vertical_scale
from missions.schema import Mission
from missions.shapes import solid

OFF_THE_FLOOR = 0.1  # m


@dataclass(frozen=True)
class Separation:
    """Smallest distance between any two robots over the flight.

    Attributes:
        t: (S,) flight clock [s]. distance: (S,) smallest of any pair [m], NaN with fewer than two seen; heights
            count as much less as the mission's vertical separation is larger than its separation.
        smallest: of two one of which is off the floor [m]; inf for one robot. pair: who. at: flight clock [s], NaN
            without data.
        clearance: smallest distance to an obstacle while searching [m], inf without obstacles.
        outside: largest distance of anybody outside the workspace while searching [m], 0 if nobody was.
        outside_robot: who that was.
    """

    t: Array
    distance: Array
    smallest: float
    pair: tuple[str, str]
    at: float
    clearance: float
    outside: float
    outside_robot: str


def separation(mission: Mission, motion: Motion, search: Array) -> Separation:
    """Distances over the whole flight; clearance and fence over ``search``, the positions (S', N, 3) of the search."""
    names = [robot.name for robot in mission.robots]
    pairs = list(itertools.combinations(range(len(names)), 2))
    scaled = motion.q * np.array([1.0, 1.0, vertical_scale(mission)])  # downwash: the mission's ellipsoid
    up = motion.q[..., 2] > OFF_THE_FLOOR
    distance = np.full(len(motion.t), np.nan)
    smallest, who, at = math.inf, ("", ""), math.nan
    for i, j in pairs:
        apart = np.linalg.norm(scaled[:, i] - scaled[:, j], axis=1)
        distance = np.fmin(distance, apart)
        apart[~(up[:, i] | up[:, j])] = np.nan  # who stands there is in nobody's way, wherever he is seen
        if np.isfinite(apart).any() and np.nanmin(apart) < smallest:
            k = int(np.nanargmin(apart))
            smallest, who, at = float(apart[k]), (names[i], names[j]), float(motion.t[k])
    outside, robot = _outside(mission, search, names)
    return Separation(
        frozen(motion.t), frozen(distance), smallest, who, at, _clearance(mission, search), outside, robot
    )


def nearest(mission: Mission, q: Array) -> Array:
    """(S,) smallest distance of any two of the positions (S, N, 3) [m], heights scaled; NaN with fewer than two."""
    scaled = q * np.array([1.0, 1.0, vertical_scale(mission)])  # downwash: the mission's ellipsoid
    out = np.full(len(q), np.nan)
    for i, j in itertools.combinations(range(q.shape[1]), 2):
        out = np.fmin(out, np.linalg.norm(scaled[:, i] - scaled[:, j], axis=1))
    return out


def clearances(mission: Mission, q: Array) -> Array:
    """(S,) smallest distance of any of the positions (S, N, 3) to any obstacle [m]; NaN without."""
    out = np.full(len(q), np.nan)
    for obstacle in mission.obstacles:
        out = np.fmin(out, np.fmin.reduce(solid(obstacle).value(np.moveaxis(q, -1, 0)), axis=1))
    return out


def _clearance(mission: Mission, q: Array) -> float:
    found = clearances(mission, q)
    return float(np.nanmin(found)) if np.isfinite(found).any() else math.inf


def _outside(mission: Mission, q: Array, names: list[str]) -> tuple[float, str]:
    nu = mission.dimension
    lower, upper = np.array(mission.workspace.lower), np.array(mission.workspace.upper)
    beyond = np.maximum(lower - q[..., :nu], q[..., :nu] - upper).max(axis=-1)  # (S, N)
    if not np.isfinite(beyond).any() or np.nanmax(beyond) <= 0.0:
        return 0.0, ""
    worst = np.unravel_index(int(np.nanargmax(beyond)), beyond.shape)
    return float(beyond[worst]), names[int(worst[1])]
