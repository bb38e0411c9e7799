"""Who is, or will be, too near to whom: all pairs in one go; no I/O."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np

from deploy.flight.seen import POSE_LOST, Finding, Limits, Seen, Vec3
from missions.arrays import Array

AHEAD = (0.2, 0.4)  # s for which separations are predicted
SEPARATION_SLACK = 0.05  # m
SEPARATION_SHARE = 0.6
_NOWHERE: Vec3 = (math.nan, math.nan, math.nan)


def separations(limits: Limits, drones: Sequence[Seen]) -> Iterator[Finding]:
    """What is found of pairs."""
    for a, b in _near(limits, drones):
        yield from _separation(limits, a, b)


def ahead(position: Vec3, velocity: Vec3, now: Vec3, drift: Vec3, later: Sequence[Vec3]) -> tuple[Vec3, ...]:
    """Where a drone will be at the times :data:`AHEAD` [m].

    Args:
        position: where it is [m].
        velocity: how it moves [m/s].
        now: where its trajectory is [m].
        drift: how that moves [m/s].
        later: where its trajectory will be at those times.
    """
    x, y, z = (p - r for p, r in zip(position, now, strict=True))
    u, v, w = (p - r for p, r in zip(velocity, drift, strict=True))
    return tuple((a + x + u * t, b + y + v * t, c + z + w * t) for t, (a, b, c) in zip(AHEAD, later, strict=True))


def _near(limits: Limits, drones: Sequence[Seen]) -> Iterator[tuple[Seen, Seen]]:
    """Pairs that are too near, or will be within the time that is looked ahead: all pairs in one go."""
    too_near = limits.separation - SEPARATION_SLACK
    distances = _distances([drone.position if drone.age <= POSE_LOST else None for drone in drones])
    matters = np.triu(distances < limits.separation + limits.closing * AHEAD[-1], 1)
    close = distances < too_near
    asked = set(np.argwhere(matters).ravel().tolist())
    soon = [drone.soon if i in asked else () for i, drone in enumerate(drones)]
    for k in range(len(AHEAD)):
        close |= _distances([places[k] if len(places) > k else None for places in soon]) < too_near
    for i, j in np.argwhere(matters & close).tolist():
        yield drones[i], drones[j]


def _distances(places: Sequence[Vec3 | None]) -> Array:
    """Of every pair (N, N) [m]; from who is nowhere they are no numbers, and so below nothing."""
    positions = np.array([place or _NOWHERE for place in places], dtype=np.float64).reshape(-1, 3)
    with np.errstate(all="ignore"):  # captured positions are what they are
        offset = positions[:, None] - positions
        distances: Array = np.sqrt(np.einsum("ijk,ijk->ij", offset, offset))
    return distances


def _separation(limits: Limits, a: Seen, b: Seen) -> list[Finding]:
    if a.position is None or b.position is None or max(a.age, b.age) > POSE_LOST:
        return []
    distance, when = math.dist(a.position, b.position), "apart"
    least = SEPARATION_SHARE * limits.separation
    for t, p, q in zip(AHEAD, a.soon, b.soon, strict=False):
        if distance >= least and (predicted := math.dist(p, q)) < least:
            distance, when = predicted, f"apart in {t:.1f} s"
    if distance >= limits.separation - SEPARATION_SLACK:
        return []
    level: Literal["warning", "abort"] = "abort" if distance < least else "warning"
    text = f"{distance:.2f} m {when}; the mission asks for {limits.separation:.2f} m"
    return [Finding(f"separation {level}", (a.robot, b.robot), level, text, distance, 0.1)]
