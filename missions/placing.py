"""The mission's object in its place: what a mesh becomes in the workspace, and what it is in the way of."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from missions.airframes import airframe
from missions.arrays import Array
from missions.errors import MissionError
from missions.information_at import information_at
from missions.meshes import OVERLAP, Mesh
from missions.objects import InspectedObject, Surface
from missions.obstacles import ObjectPart
from missions.schema import FacingYaw, Mission
from missions.validate_object import check_placed, check_reached
from missions.validate_places import check_places

SLICES, SIDES = 8, 12  # of the prisms around an object, before neighbours that are alike become one
ALIKE = 0.1  # share by which a prism may be larger than the two it stands for
_GOLDEN = (0.7548776662466927, 0.5698402909980532)  # Roberts's R2 sequence: points that keep apart in a square


def with_object(
    mission: Mission, item: InspectedObject, mesh: Mesh, *, looks: bool, error: Callable[[str, str], MissionError]
) -> Mission:
    """The mission with its object in its place, in everybody's way, and with everybody facing it.

    Args:
        mission: its maps read.
        item: the mission's object.
        mesh: what is in its file.
        looks: whether robots face it, because the mission does not say where they look.
        error: makes the MissionError for a reason and a path.

    Raises:
        MissionError: a size or a place at which it cannot be flown around, or no information on it.
    """
    vertices = placed(item, mesh)
    check_placed(mission, vertices, error)
    surface = _surface(mission, item, mesh, vertices, error)
    check_reached(mission, surface, error)
    trajectory = mission.trajectory
    if looks:
        trajectory = dataclasses.replace(trajectory, yaw=FacingYaw(surface.centre))
    mission = dataclasses.replace(
        mission,
        object=dataclasses.replace(item, surface=surface),
        obstacles=(*mission.obstacles, *parts(vertices, mesh.faces, item.near)),
        trajectory=trajectory,
    )
    check_places(mission, airframe(mission.flight.airframe), error)
    return mission


def _surface(
    mission: Mission,
    item: InspectedObject,
    mesh: Mesh,
    vertices: Array,
    error: Callable[[str, str], MissionError],
) -> Surface:
    points, normals, face, area = spread(vertices, mesh.faces, item.samples)
    if mesh.two_sided:
        area /= OVERLAP**2
    lower = np.array([*mission.workspace.lower[:2], 0.0])
    density = information_at(mission.information, points, lower, np.array(mission.workspace.upper))
    if not density.max() > 0.0:
        raise error("nothing of it is on the object's surface; allowed: information that is", "information")
    if item.facing is not None:
        if mesh.two_sided:
            raise error(
                "got a direction for a point cloud, which has no outside; allowed: with a mesh", "object.facing"
            )
        density = density * np.maximum(normals @ np.array(item.facing) / math.hypot(*item.facing), 0.0)
        if not density.max() > 0.0:
            raise error("no information is on what faces this way; allowed: a direction it does", "object.facing")
    return Surface(vertices, mesh.faces, points, normals, area, density / density.sum(), face, mesh.two_sided)


def placed(item: InspectedObject, mesh: Mesh) -> Array:
    """(V, 3) vertices in the world frame [m]: scaled, turned, put where the mission says."""
    c, s = math.cos(item.yaw), math.sin(item.yaw)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])  # of rows
    return np.asarray(item.scale * mesh.vertices @ turn + np.array(item.position))


def spread(vertices: Array, faces: NDArray[np.intp], count: int) -> tuple[Array, Array, NDArray[np.intp], float]:
    """Points all over a surface: each stands for as much area as every other.

    Returns:
        Points (J, 3) [m], their outward normals (J, 3), their faces (J,), and the area of each [m²].
    """
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    cross = np.cross(b - a, c - a)
    area = 0.5 * np.linalg.norm(cross, axis=1)
    total = float(area.sum())
    face = np.searchsorted(area.cumsum(), (np.arange(count) + 0.5) / count * total).clip(max=len(faces) - 1)
    u, v = ((np.arange(1, count + 1)[:, None] * np.array(_GOLDEN)) % 1.0).T
    folded = u + v > 1.0
    u, v = np.where(folded, 1.0 - u, u)[:, None], np.where(folded, 1.0 - v, v)[:, None]
    points = a[face] + u * (b - a)[face] + v * (c - a)[face]
    normals = cross[face] / np.maximum(2.0 * area[face], 1e-300)[:, None]
    return points, normals, face, total / count


def parts(vertices: Array, faces: NDArray[np.intp], near: float) -> tuple[ObjectPart, ...]:
    """Prisms that hold everything closer than ``near`` [m] to a surface: convex slices, each grown by it.

    Every slice is the convex hull of what lies between two heights, seen from above, bounded by SIDES directions: what
    is hollow, or a cave, is filled.
    """
    levels = np.linspace(vertices[:, 2].min(), vertices[:, 2].max(), SLICES + 1)
    angle = 2.0 * math.pi * np.arange(SIDES) / SIDES
    n = np.stack((np.cos(angle), np.sin(angle)))  # (2, SIDES)
    between = ((float(low), float(high), _between(vertices, faces, low, high)) for low, high in pairwise(levels))
    slices = [(low, high, (points @ n).max(axis=0) + near) for low, high, points in between if len(points)]
    return tuple(
        ObjectPart(
            vertices=tuple((float(x), float(y)) for x, y in _corners(support, n)),
            base=max(low - near, 0.0),
            height=high + near,
        )
        for low, high, support in _joined(slices, n)
    )


Slice = tuple[float, float, Array]  # from height to height [m], reach (SIDES,) [m] in every direction


def _joined(slices: list[Slice], n: Array) -> list[Slice]:
    """Neighbours as one as long as that is hardly larger than they are: fewer shapes to keep clear of."""
    out = [slices[0]]
    volume = _volume(slices[0], n)
    for low, high, support in slices[1:]:
        bottom, _, reach = out[-1]
        both = (bottom, high, np.maximum(reach, support))
        volume += _volume((low, high, support), n)
        if _volume(both, n) <= (1.0 + ALIKE) * volume:
            out[-1] = both
        else:
            out.append((low, high, support))
            volume = _volume(out[-1], n)
    return out


def _between(vertices: Array, faces: NDArray[np.intp], low: float, high: float) -> Array:
    """(M, 2) points seen from above whose hull is that of the surface between two heights: ends of clipped edges."""
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    a, b = vertices[edges[:, 0]], vertices[edges[:, 1]]
    rise = b[:, 2] - a[:, 2]
    level = np.abs(rise) < 1e-12
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = (np.array([[low], [high]]) - a[:, 2]) / rise  # (2, E) where the edge meets both heights
    enter = np.where(level, 0.0, np.clip(ends.min(axis=0), 0.0, 1.0))
    leave = np.where(level, 1.0, np.clip(ends.max(axis=0), 0.0, 1.0))
    inside = np.where(
        level, (a[:, 2] >= low) & (a[:, 2] <= high), (ends.max(axis=0) >= 0.0) & (ends.min(axis=0) <= 1.0)
    )
    way = (b - a)[inside, :2]
    first = a[inside, :2]
    return np.concatenate([first + enter[inside, None] * way, first + leave[inside, None] * way])


def _corners(support: Array, n: Array) -> Array:
    """(SIDES, 2) corners of the polygon that reaches ``support`` along the unit vectors n (2, SIDES)."""
    following, m = np.roll(support, -1), np.roll(n, -1, axis=1)
    determinant = n[0] * m[1] - n[1] * m[0]
    x = (support * m[1] - following * n[1]) / determinant
    y = (n[0] * following - m[0] * support) / determinant
    return np.stack((x, y), axis=1)


def _volume(slice_: Slice, n: Array) -> float:
    low, high, support = slice_
    x, y = _corners(support, n).T
    return 0.5 * (high - low) * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
