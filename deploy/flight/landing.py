"""Who lands first and who waits, and whose motors may be stopped; no I/O.

Everybody lands straight down, and those who are apart land together. Of two that are nearer to each other than the
separation, seen from above, the lower one lands first and the upper one waits in its hover: it would otherwise sink
into the lower one, or the lower one would be caught in its downwash.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

Vec3 = tuple[float, float, float]
Waves = tuple[tuple[str, ...], ...]
_SAME = 0.05  # m; robots whose heights differ by less may land together
_GRAVITY = 9.81  # m/s²


def landing_waves(hovering: Mapping[str, Vec3], separation: float) -> Waves:
    """Who lands together with whom, one wave after another.

    Args:
        hovering: where everybody hovers [m].
        separation: how far apart robots have to be to land independently, seen from above [m].
    """
    below = {name: _below(name, hovering, separation) for name in hovering}
    waves, left = [], set(hovering)
    while left:
        ready = tuple(name for name in hovering if name in left and not below[name] & left)
        waves.append(ready)
        left -= set(ready)
    return tuple(waves)


def with_those_below(names: Collection[str], hovering: Mapping[str, Vec3], separation: float) -> tuple[str, ...]:
    """These, and whoever has to land before they can; arguments as of :func:`landing_waves`."""
    found = {name for name in names if name in hovering}
    front = sorted(found)
    while front:
        new = _below(front.pop(), hovering, separation) - found
        found |= new
        front += sorted(new)
    return tuple(name for name in hovering if name in found)


def may_fall(name: str, positions: Mapping[str, Vec3], velocity: Vec3, separation: float) -> bool:
    """Whether nobody is where a drone falls when its motors stop.

    Args:
        name: who falls.
        positions: where everybody is [m], also who stands.
        velocity: of who falls [m/s].
        separation: how far others have to be from the way down, seen from above [m].
    """
    x, y, z = positions[name]
    for other, (ox, oy, oz) in positions.items():
        if other == name or oz >= z - _SAME:
            continue
        fall = (velocity[2] + math.sqrt(velocity[2] ** 2 + 2.0 * _GRAVITY * (z - oz))) / _GRAVITY
        if _from_way((ox - x, oy - y), (velocity[0] * fall, velocity[1] * fall)) < separation:
            return False
    return True


def _below(name: str, hovering: Mapping[str, Vec3], separation: float) -> set[str]:
    here = hovering[name]
    return {
        other
        for other, there in hovering.items()
        if other != name and there[2] < here[2] - _SAME and math.dist(here[:2], there[:2]) < separation
    }


def _from_way(point: tuple[float, float], way: tuple[float, float]) -> float:
    """Distance of a point from the straight way from the origin [m]."""
    length2 = way[0] ** 2 + way[1] ** 2
    s = min(1.0, max(0.0, (point[0] * way[0] + point[1] * way[1]) / length2)) if length2 else 0.0
    return math.dist(point, (s * way[0], s * way[1]))
