"""Who leaves when: everybody flies his way at his own pace, and waits before it for as long as he has to.

Robots are given their delays one after another: first those in whose place others want to pass, last those who end
where others pass. Distances are looked at every 50 ms, between which they differ by less than a tenth of what is kept
in hand.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.transfer.scene import Scene, closest

SAMPLE = 0.05  # [s]
_STEP = 10  # samples between delays that are tried
_MOST_DELAYS = 200  # tried for each robot
_SMOOTH = np.array([-20.0, 70.0, -84.0, 35.0, 0.0, 0.0, 0.0, 0.0])  # of the commander's moves, descending powers


@dataclass(frozen=True)
class Way:
    """What one robot flies, whenever it leaves.

    Attributes:
        points: (K+1, 3) from where it hovers to its goal [m].
        begins: (K,) when each of its moves begins after it has left [s].
        durations: (K,) of them [s].
    """

    points: Array
    begins: Array
    durations: Array

    def sampled(self) -> Array:
        """(L, 3) where it is every :data:`SAMPLE` from leaving to arriving [m]."""
        if not len(self.begins):
            return self.points[:1]
        t = np.arange(0.0, self.begins[-1] + self.durations[-1] + SAMPLE, SAMPLE)
        k = np.clip(np.searchsorted(self.begins, t, side="right") - 1, 0, len(self.begins) - 1)
        s = np.polyval(_SMOOTH, np.clip((t - self.begins[k]) / self.durations[k], 0.0, 1.0))[:, None]
        return np.asarray(self.points[k] + s * (self.points[k + 1] - self.points[k]))


def delays(scene: Scene, ways: Sequence[Way]) -> list[float] | None:
    """When everybody leaves [s]; None if somebody can leave at no time, given the others."""
    samples = [way.sampled() for way in ways]
    meets = [[_meet(scene, i, j, a, b) for j, b in enumerate(ways)] for i, a in enumerate(ways)]
    leaves: dict[int, int] = {}
    for k in _order(scene, ways):
        others = [j for j in leaves if meets[k][j]]
        free = next(
            (s for s in range(0, _STEP * _MOST_DELAYS, _STEP) if _free(scene, samples, leaves, others, k, s)), None
        )
        if free is None:
            return None
        leaves[k] = free
    return [leaves[k] * SAMPLE for k in range(len(ways))]


def _free(
    scene: Scene, samples: Sequence[Array], leaves: dict[int, int], others: Sequence[int], robot: int, leave: int
) -> bool:
    """Whether a robot that leaves at a sample keeps away from others whose times are known."""
    for j in others:
        last = max(leave + len(samples[robot]), leaves[j] + len(samples[j]))
        apart = (_at(samples[robot], leave, last) - _at(samples[j], leaves[j], last)) * scene.scale
        if (np.einsum("ta,ta->t", apart, apart) < scene.least[robot, j] ** 2).any():
            return False
    return True


def _at(samples: Array, leave: int, last: int) -> Array:
    """(last, 3) where a robot is from the beginning on."""
    return samples[np.clip(np.arange(last) - leave, 0, len(samples) - 1)]


def _meet(scene: Scene, i: int, j: int, a: Way, b: Way) -> bool:
    """Whether two ways come so close that it matters when they are flown: by boxes around them."""
    if i == j:
        return False
    low = np.maximum(a.points.min(axis=0), b.points.min(axis=0)) * scene.scale
    high = np.minimum(a.points.max(axis=0), b.points.max(axis=0)) * scene.scale
    return bool(np.linalg.norm(np.maximum(low - high, 0.0)) < scene.least[i, j])


def _order(scene: Scene, ways: Sequence[Way]) -> list[int]:
    """Whom others pass at his beginning goes before them, who is passed at his goal after; the longest ways first."""
    first = np.array([_passed(scene, ways, k, 0) for k in range(len(ways))])  # (N, N) who passes whose beginning
    last = np.array([_passed(scene, ways, k, -1) for k in range(len(ways))])  # and whose goal
    before = first | last.T  # k before j
    length = [float(np.linalg.norm(np.diff(way.points, axis=0), axis=1).sum()) for way in ways]
    left, order = set(range(len(ways))), []
    while left:
        waits = {k: int(before[list(left), k].sum()) for k in left}
        k = min(left, key=lambda k: (waits[k], -length[k], k))
        order.append(k)
        left.remove(k)
    return order


def _passed(scene: Scene, ways: Sequence[Way], robot: int, end: int) -> Array:
    """(N,) who comes too close to where a robot hovers at one end of its way."""
    place, found = ways[robot].points[end], np.zeros(len(ways), dtype=np.bool_)
    for j, way in enumerate(ways):
        for a, b in itertools.pairwise(way.points):
            found[j] |= j != robot and bool(
                closest((a - place) * scene.scale, (b - place) * scene.scale) < scene.least[robot, j]
            )
    return np.asarray(found)
