"""Before and after the search: straight up at the pads, straight and together to the starts, straight down at the end.

The commander's take-off, go-to and landing follow one rest-to-rest profile of degree 7. Robots that move together for
the same time share its progress s, so positions are linear in s and so is the distance vector of every pair. All
distances are horizontal: a column of air belongs to one robot, whatever the heights.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from missions.arrays import Array
from missions.schema import Mission
from planner.connectivity.pairs import all_pairs


def starts(mission: Mission) -> Array:
    """(N, 2) where the searches start, seen from above [m]."""
    return np.array([robot.start[:2] for robot in mission.robots], dtype=np.float64)


def pads(mission: Mission) -> Array:
    """(N, 2) landing pads [m]: under the start unless the mission says otherwise."""
    return np.array([(robot.pad or robot.start)[:2] for robot in mission.robots], dtype=np.float64)


def smallest_distance(begin: Array, end: Array) -> tuple[float, tuple[int, int] | None]:
    """Smallest distance of any pair during straight moves that share their progress.

    Args:
        begin: (N, 2) [m].
        end: (N, 2) [m]; the same array for robots that stand still or move vertically.

    Returns:
        The distance [m] and the pair; inf and None for one robot.
    """
    pairs = all_pairs(len(begin))
    if len(pairs) == 0:
        return np.inf, None
    i, j = pairs.T
    d0 = begin[j] - begin[i]
    way = (end[j] - end[i]) - d0
    length2 = np.einsum("pa,pa->p", way, way)
    s = np.clip(-np.einsum("pa,pa->p", d0, way) / np.where(length2 > 0, length2, 1.0), 0.0, 1.0)
    distance = np.linalg.norm(d0 + s[:, None] * way, axis=1)
    worst = int(np.argmin(distance))
    return float(distance[worst]), (int(i[worst]), int(j[worst]))


def names_of(pair: tuple[int, int] | None, names: Sequence[str]) -> str:
    """``a–b``, or nothing."""
    return f"{names[pair[0]]}–{names[pair[1]]}" if pair else ""
