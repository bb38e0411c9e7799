"""Records of what robots stay out of, and of where they stay.

Obstacles are things: they bind the search, the way to it and the landing. Zones are rules: keep-out zones bind the
same as obstacles do, but may be given to some robots only; keep-in zones bind the search alone, as the workspace does,
so that pads may lie outside them. The centre of a robot is what stays outside or inside: add its size.
Geometry is in :mod:`missions.shapes`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from missions.fields import NAME, Vector, field

MOST_VERTICES = 100


@dataclass(frozen=True)
class CircleObstacle:
    """A vertical cylinder from floor to ceiling, seen from above; robots' centres stay outside."""

    center: Vector = field("centre (x, y)", unit="m", items=(2, 2))
    radius: float = field("radius", unit="m", above=0.0)
    type: Literal["circle"] = "circle"


@dataclass(frozen=True)
class CylinderObstacle:
    """A vertical cylinder of some height: robots may fly over it, and under it if its base is above the floor."""

    center: Vector = field("centre (x, y)", unit="m", items=(2, 2))
    radius: float = field("radius", unit="m", above=0.0)
    height: float = field("height of its top above the floor", unit="m", above=0.0)
    base: float = field("height of its base above the floor", unit="m", at_least=0.0, default=0.0)
    type: Literal["cylinder"] = "cylinder"


@dataclass(frozen=True)
class BoxObstacle:
    """A box; with two numbers a corner it reaches from floor to ceiling."""

    lower: Vector = field("lower corner before it is turned, (x, y) or (x, y, z)", unit="m", items=(2, 3))
    upper: Vector = field("upper corner before it is turned", unit="m", items=(2, 3))
    rotation: float = field(
        "turn about the vertical through its centre, counter-clockwise from above", unit="rad", default=0.0
    )
    type: Literal["box"] = "box"


@dataclass(frozen=True)
class PolygonObstacle:
    """A convex polygon seen from above; without a height it reaches the ceiling."""

    vertices: tuple[Vector, ...] = field("corners (x, y), in order around it", unit="m", items=(3, MOST_VERTICES))
    height: float | None = field("height of its top above the floor", unit="m", above=0.0, default=None)
    base: float = field("height of its base above the floor", unit="m", at_least=0.0, default=0.0)
    type: Literal["polygon"] = "polygon"


@dataclass(frozen=True)
class ObjectPart(PolygonObstacle):
    """A slice of the mission's object with the room to keep from it: no file says it, the object's mesh does."""


@dataclass(frozen=True)
class KeepOutZone:
    """A convex polygon, floor to ceiling, that some or all robots stay out of."""

    vertices: tuple[Vector, ...] = field("corners (x, y), in order around it", unit="m", items=(3, MOST_VERTICES))
    robots: tuple[str, ...] = field("whom it binds; default: everybody", default=(), items=(0, 100), pattern=NAME)
    type: Literal["keep_out"] = "keep_out"


@dataclass(frozen=True)
class KeepInZone:
    """A convex polygon, floor to ceiling, that some or all robots stay in while they search."""

    vertices: tuple[Vector, ...] = field("corners (x, y), in order around it", unit="m", items=(3, MOST_VERTICES))
    robots: tuple[str, ...] = field("whom it binds; default: everybody", default=(), items=(0, 100), pattern=NAME)
    type: Literal["keep_in"] = "keep_in"


Obstacle = CircleObstacle | CylinderObstacle | BoxObstacle | PolygonObstacle
Zone = KeepOutZone | KeepInZone


def label(number: int, obstacle: Obstacle) -> str:
    """What messages call an obstacle of a mission: where the file says it."""
    return "object" if isinstance(obstacle, ObjectPart) else f"obstacles[{number}]"
