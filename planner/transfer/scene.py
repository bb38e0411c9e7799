"""What robots stay clear of on the way: prisms around what the mission says, a fence, and each other.

Clearances are wider than the mission's limits by :data:`ROOM`, which covers what tracking and an order that arrives
late may take, except where a robot is given no more: nobody can be asked to begin farther away than he hovers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missions import fleet
from missions.arrays import Array
from missions.obstacles import KeepOutZone, label
from missions.schema import Mission
from missions.shapes import Solid, outline, solid
from planner.transfer.errors import TransferError
from planner.transfer.prisms import Prism, grown

ROOM = 0.05  # [m] kept beyond the limits where possible
FENCE_SHARE = 0.5  # of the geofence margin may be planned with; the rest is for tracking
_ROUNDING = 1e-6  # [m]
_TOLERANCE = 1e-3  # [m] as certificates have it


@dataclass(frozen=True)
class Scene:
    """The surroundings of N robots that go from one place to another.

    Attributes:
        names: (N,) of the robots.
        prisms: (N,) what each of them stays out of.
        least: (N, N) distances to keep [m]; vertical ones count ``scale`` times as much.
        scale: (3,) by how much distances between robots count along each axis.
        lower: (3,) corner of where they may be [m].
        upper: (3,) and the other.
    """

    names: tuple[str, ...]
    prisms: tuple[tuple[Prism, ...], ...]
    least: Array
    scale: Array
    lower: Array
    upper: Array

    def blocked_by(self, robot: int, begin: Array, ends: Array) -> tuple[NDArray[np.bool_], str]:
        """(M,) which straight moves from a point (3,) to others (M, 3) hit something, and the first that is hit."""
        blocked, label = np.zeros(len(ends), dtype=np.bool_), ""
        for prism in self.prisms[robot]:
            hit = prism.hits(begin, ends)
            label = label or (prism.label if hit.any() else "")
            blocked |= hit
        return blocked, label

    def near(self, robot: int, begin: Array, ends: Array, others: Sequence[int], where: Array) -> NDArray[np.bool_]:
        """(M,) which straight moves come too close to others (K,) that hover at (K, 3) [m]."""
        if not others:
            return np.zeros(len(ends), dtype=np.bool_)
        kept = list(others)
        apart = closest((begin - where)[:, None] * self.scale, (ends - where[:, None]) * self.scale)
        return np.asarray((apart < self.least[robot, kept][:, None]).any(axis=0))

    def clash(self, begin: Array, end: Array, target: Array, robot: int) -> bool:
        """Whether a robot that moves to a target (3,) comes too close to anybody.

        All move straight from (N, 3) to (N, 3) and share their progress; who hovers begins where he ends.
        """
        apart = closest((begin[robot] - begin) * self.scale, (target - end) * self.scale)
        apart[robot] = np.inf
        return bool((apart < self.least[robot]).any())


def closest(begin: Array, end: Array) -> Array:
    """Smallest distance (...) to the origin of straight ways from (..., 3) to (..., 3)."""
    way = end - begin
    length2 = np.einsum("...a,...a->...", way, way)
    s = np.clip(-np.einsum("...a,...a->...", begin + 0.0 * way, way) / np.where(length2 > 0.0, length2, 1.0), 0.0, 1.0)
    return np.asarray(np.linalg.norm(begin + s[..., None] * way, axis=-1))


def survey(mission: Mission, begin: Array, goal: Array, *, hurried: bool = False) -> Scene:
    """The scene of robots that go from (N, 3) to (N, 3) [m].

    Args:
        mission: what is in the way.
        begin: where they hover.
        goal: where they go.
        hurried: after an abort, when robots may be anywhere: what is given is never refused.

    Raises:
        TransferError: two robots begin or end closer than the mission allows.
    """
    names = tuple(robot.name for robot in mission.robots)
    scale = np.array([1.0, 1.0, fleet.transfer_scale(mission)])
    given = np.minimum(*(np.linalg.norm((x[:, None] - x) * scale, axis=-1) for x in (begin, goal)))
    np.fill_diagonal(given, np.inf)
    i, j = np.unravel_index(int(given.argmin()), given.shape)
    if given[i, j] < mission.limits.separation - _TOLERANCE and not hurried:
        at, x = ("beginning", begin) if np.linalg.norm((begin[i] - begin[j]) * scale) <= given[i, j] else ("end", goal)
        counted = ", vertical distance counted as downwash has it" if x[i, 2] != x[j, 2] else ""
        raise TransferError(
            f"{names[i]} and {names[j]} are {given[i, j]:.3g} m apart at the {at} of their way{counted}; allowed: "
            f"at least {mission.limits.separation:g} [m]"
        )
    least = np.minimum(mission.limits.separation + ROOM, given - _ROUNDING)
    lower, upper = fleet.fence(mission)
    margin = FENCE_SHARE * mission.flight.geofence_margin
    low = min(float(begin[:, 2].min()), float(goal[:, 2].min()))  # nobody flies lower than he has to
    prisms = tuple(_prisms(mission, k, np.stack([begin[k], goal[k]])) for k in range(len(names)))
    return Scene(names, prisms, least, scale, np.array([*(lower[:2] - margin), low]), upper + margin)


def _prisms(mission: Mission, robot: int, given: Array) -> tuple[Prism, ...]:
    things = [(label(k, obstacle), solid(obstacle)) for k, obstacle in enumerate(mission.obstacles)]
    name = mission.robots[robot].name
    for k, zone in enumerate(mission.zones):
        if isinstance(zone, KeepOutZone) and (not zone.robots or name in zone.robots):
            things.append((f"zones[{k}]", Solid(outline(zone))))
    return tuple(grown(label, body, ROOM, given) for label, body in things)
