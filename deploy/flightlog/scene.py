"""What viewers draw: mission, map, trajectories, drones and who is within range, as Foxglove's own messages.

Everything that stands still is written once; drones are drawn in frames of their own, which ``/tf`` moves. A viewer
that jumps to any time takes each topic's newest message before it, so nothing has to be repeated.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from deploy.flightlog.encode import IDENTITY, timestamp, vector
from deploy.flightlog.topics import WORLD
from deploy.heat import heat_image
from missions.arrays import Array
from missions.fleet import altitudes
from missions.obstacles import Obstacle, Zone
from missions.schema import Mission
from missions.shapes import heights, outline

Json = dict[str, object]
Colour = tuple[float, float, float, float]
Place = tuple[Sequence[float], Sequence[float] | None]  # position [m], quaternion x, y, z, w or None

_STRIP, _LOOP, _LIST = 0, 1, 2  # foxglove.LineType
_UINT8 = 1  # foxglove.NumericType
_DRONE = (0.12, 0.12, 0.04)  # m
_INK: Colour = (0.45, 0.45, 0.5, 1.0)
_SOLID: Colour = (0.55, 0.5, 0.5, 0.5)
_ZONE: Colour = (0.85, 0.45, 0.1, 1.0)
_LINK: Colour = (0.2, 0.75, 0.35, 1.0)
_GROUNDED = 0.1  # m; lower drones stand on their pads and search nothing
ROBOTS: tuple[Colour, ...] = (
    (0.16, 0.47, 0.84, 1.0),
    (0.92, 0.49, 0.13, 1.0),
    (0.18, 0.62, 0.35, 1.0),
    (0.78, 0.25, 0.35, 1.0),
    (0.53, 0.37, 0.75, 1.0),
    (0.10, 0.63, 0.66, 1.0),
    (0.80, 0.62, 0.10, 1.0),
    (0.85, 0.40, 0.66, 1.0),
)


def map_grid(mission: Mission, nanoseconds: int) -> Json:
    """The information map on the floor, a ``foxglove.Grid``: one byte a cell, 255 where there is most to see."""
    image = heat_image(mission)
    width, height = int(str(image["width"])), int(str(image["height"]))
    lower, upper = mission.workspace.lower, mission.workspace.upper
    return {
        "timestamp": timestamp(nanoseconds),
        "frame_id": WORLD,
        "pose": _pose((lower[0], lower[1], 0.0)),
        "column_count": width,
        "cell_size": {"x": (upper[0] - lower[0]) / width, "y": (upper[1] - lower[1]) / height},
        "row_stride": width,
        "cell_stride": 1,
        "fields": [{"name": "information", "offset": 0, "type": _UINT8}],
        "data": image["data"],
    }


def mission_scene(mission: Mission, paths: Mapping[str, Array], nanoseconds: int) -> Json:
    """Workspace, obstacles, zones and certified paths, a ``foxglove.SceneUpdate``.

    Args:
        mission: what is searched.
        paths: (S, 3) by robot [m].
        nanoseconds: time of the message.
    """
    (x0, y0), (x1, y1) = mission.workspace.lower[:2], mission.workspace.upper[:2]
    box = mission.workspace
    floor, ceiling = (box.lower[2], box.upper[2]) if len(box.lower) == 3 else (0.0, float(altitudes(mission).max()))
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    rings = [_line(_LOOP, [(x, y, z) for x, y in corners], _INK, 0.01) for z in (floor, ceiling)]
    entities = [_entity("workspace", nanoseconds, lines=rings)]
    for k, obstacle in enumerate(mission.obstacles):
        entities.append(_prism(f"obstacle {k}", obstacle, ceiling, _SOLID, nanoseconds, solid=True))
    for k, zone in enumerate(mission.zones):
        entities.append(_prism(f"zone {k}", zone, ceiling, _ZONE, nanoseconds, solid=False))
    for k, (name, path) in enumerate(paths.items()):
        line = _line(_STRIP, path.tolist(), (*colour(k)[:3], 0.5), 0.008)
        entities.append(_entity(f"path {name}", nanoseconds, lines=[line]))
    return {"deletions": [], "entities": entities}


def drones_scene(names: Sequence[str], nanoseconds: int) -> Json:
    """A body and a name for every robot in its own frame, a ``foxglove.SceneUpdate``."""
    entities = []
    for k, name in enumerate(names):
        size = dict(zip("xyz", _DRONE, strict=True))
        body = {"pose": _pose((0.0, 0.0, 0.0)), "size": size, "color": _rgba(colour(k))}
        label = {
            "pose": _pose((0.0, 0.0, 0.12)),
            "billboard": True,
            "font_size": 12.0,
            "scale_invariant": True,
            "color": _rgba(colour(k)),
            "text": name,
        }
        entities.append(_entity(name, nanoseconds, frame=name, spheres=[body], texts=[label]))
    return {"deletions": [], "entities": entities}


def transforms(places: Mapping[str, Place], nanoseconds: int) -> Json:
    """Where the robots' frames are, a ``foxglove.FrameTransforms``."""
    time = timestamp(nanoseconds)
    out = []
    for name, (position, quaternion) in places.items():
        x, y, z, w = IDENTITY if quaternion is None else quaternion
        rotation = {"x": float(x), "y": float(y), "z": float(z), "w": float(w)}
        out.append(
            {
                "timestamp": time,
                "parent_frame_id": WORLD,
                "child_frame_id": name,
                "translation": vector(position),
                "rotation": rotation,
            }
        )
    return {"transforms": out}


def links_scene(places: Mapping[str, Place], reach: float, nanoseconds: int) -> Json:
    """A line between any two robots in the air within ``reach`` [m] of each other, a ``foxglove.SceneUpdate``."""
    up = [position for position, _ in places.values() if position[2] > _GROUNDED]
    ends = [
        end
        for i, one in enumerate(up)
        for other in up[i + 1 :]
        if math.dist(one, other) <= reach
        for end in (one, other)
    ]
    return {
        "deletions": [],
        "entities": [_entity("links", nanoseconds, lines=[_line(_LIST, ends, _LINK, 0.015)])],
    }


def colour(number: int) -> Colour:
    """A robot's colour, by its place in the mission."""
    return ROBOTS[number % len(ROBOTS)]


def _entity(name: str, nanoseconds: int, *, frame: str = WORLD, **primitives: list[Json]) -> Json:
    return {
        "timestamp": timestamp(nanoseconds),
        "frame_id": frame,
        "id": name,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": True,
        "metadata": [],
        **primitives,
    }


def _prism(name: str, shape: Obstacle | Zone, ceiling: float, tint: Colour, nanoseconds: int, *, solid: bool) -> Json:
    """An obstacle or a zone as outlines at base and top, and the wall between them."""
    low, high = heights(shape)
    low, high = max(low, 0.0), min(high, max(ceiling, low))
    ring = outline(shape)
    rings = [[(float(x), float(y), z) for x, y in ring] for z in (low, high)]
    lines = [_line(_LOOP, points, (*tint[:3], 1.0), 0.01) for points in rings]
    if not solid:
        return _entity(name, nanoseconds, lines=lines)
    M = len(ring)
    wall = [(k, (k + 1) % M, M + k) for k in range(M)] + [((k + 1) % M, M + (k + 1) % M, M + k) for k in range(M)]
    top = [(M, M + k, M + k + 1) for k in range(1, M - 1)]  # outlines are convex
    triangles: Json = {
        "pose": _pose((0.0, 0.0, 0.0)),
        "points": [_point(point) for points in rings for point in points],
        "color": _rgba(tint),
        "colors": [],
        "indices": np.array(wall + top).ravel().tolist(),
    }
    return _entity(name, nanoseconds, lines=lines, triangles=[triangles])


def _line(kind: int, points: Sequence[Sequence[float]], tint: Colour, thickness: float) -> Json:
    return {
        "type": kind,
        "pose": _pose((0.0, 0.0, 0.0)),
        "thickness": thickness,
        "scale_invariant": False,
        "points": [_point(point) for point in points],
        "color": _rgba(tint),
        "colors": [],
        "indices": [],
    }


def _pose(position: Sequence[float]) -> Json:
    return {"position": vector(position), "orientation": dict(zip("xyzw", IDENTITY, strict=True))}


def _point(point: Sequence[float]) -> dict[str, float]:
    return {axis: round(float(value), 4) for axis, value in zip("xyz", point, strict=True)}


def _rgba(tint: Colour) -> dict[str, float]:
    return dict(zip("rgba", tint, strict=True))
