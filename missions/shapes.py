"""The geometry of obstacles and zones: convex footprints between two heights.

Every obstacle is one :class:`Solid`: a convex polygon, or a point, grown by a radius (a point becomes a disc), between
two heights. The signed distance to a convex set is convex and has a gradient of length 1 everywhere but on the ridge
deep inside, where the nearest sides change: outside it is the exact distance, inside minus the depth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from missions.arrays import Array, frozen
from missions.obstacles import BoxObstacle, CircleObstacle, CylinderObstacle, Obstacle, PolygonObstacle, Zone

_CIRCLE_POINTS = 48


class SignedDistance(NamedTuple):
    """Distance to a solid's surface, negative inside, and its gradient.

    Attributes:
        value: (...) [m].
        gradient: (3, ...) unit vectors.
    """

    value: Array
    gradient: Array


class Sides(NamedTuple):
    """The E sides of a polygon: inside is normals · x ≤ offsets; a side's points have tangents · x from begins on.

    Attributes:
        normals: (E, 2) outward. offsets: (E, 1) [m].
        tangents: (E, 2). begins: (E, 1) [m]. lengths: (E, 1) [m].
    """

    normals: Array
    offsets: Array
    tangents: Array
    begins: Array
    lengths: Array


@dataclass(frozen=True)
class Solid:
    """A convex set with a vertical wall: (footprint ⊕ disc) × [low, high].

    Attributes:
        vertices: (V, 2) of the footprint, counter-clockwise [m]; one vertex is a point.
        radius: of the disc the footprint is grown by [m].
        low: height of the base [m]; −inf for what stands on the floor: nothing passes below.
        high: height of the top [m]; inf for what reaches the ceiling.
    """

    vertices: Array
    radius: float = 0.0
    low: float = -math.inf
    high: float = math.inf

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", frozen(self.vertices))

    @cached_property
    def sides(self) -> Sides:
        """The sides of the footprint, worked out once."""
        normals, offsets = half_planes(self.vertices)
        tangents = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
        lengths = np.linalg.norm(np.roll(self.vertices, -1, axis=0) - self.vertices, axis=1)
        begins = np.einsum("ea,ea->e", tangents, self.vertices)
        return Sides(normals, offsets[:, None], tangents, begins[:, None], lengths[:, None])

    def column(self) -> Solid:
        """The same footprint from floor to ceiling."""
        return Solid(self.vertices, self.radius)

    def value(self, x: Array) -> Array:
        """Signed distance (...) of points x (3, ...) [m] without its gradient, several times faster."""
        aside = _footprint_value(self, x[:2]) - self.radius
        if math.isinf(self.low) and math.isinf(self.high):
            return aside
        above = np.maximum(x[2] - self.high, self.low - x[2])
        outside = np.hypot(np.maximum(aside, 0.0), np.maximum(above, 0.0))
        return np.asarray(outside + np.minimum(np.maximum(aside, above), 0.0))

    def distance(self, x: Array) -> SignedDistance:
        """Signed distance of points x (3, ...) [m]: axes first, where NumPy is fast."""
        aside, outward = _footprint_distance(self, x[:2])
        aside = aside - self.radius
        up = np.where(x[2] - self.high >= self.low - x[2], 1.0, -1.0)
        above = np.maximum(x[2] - self.high, self.low - x[2])
        corner = (aside > 0.0) & (above > 0.0)  # nearest is the rim of top or base
        value = np.maximum(aside, above)
        value[corner] = np.hypot(aside[corner], above[corner])
        share = (aside >= above).astype(np.float64)  # of the gradient that is horizontal
        share[corner] = aside[corner] / value[corner]
        rise = (aside < above).astype(np.float64)
        rise[corner] = above[corner] / value[corner]
        return SignedDistance(value, np.concatenate([outward * share, (up * rise)[None]]))


def solid(obstacle: Obstacle) -> Solid:
    """What an obstacle fills."""
    if isinstance(obstacle, CircleObstacle):
        return Solid(np.array([obstacle.center]), obstacle.radius)
    low, high = heights(obstacle)
    low = low if low > 0.0 else -math.inf
    if isinstance(obstacle, CylinderObstacle):
        return Solid(np.array([obstacle.center]), obstacle.radius, low, high)
    return Solid(outline(obstacle), 0.0, low, high)


def outline(shape: Obstacle | Zone) -> Array:
    """(M, 2) polygon around an obstacle or a zone seen from above, counter-clockwise [m]; circles get 48 corners."""
    if isinstance(shape, CircleObstacle | CylinderObstacle):
        angle = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_POINTS, endpoint=False)
        return np.array(shape.center) + shape.radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    if isinstance(shape, BoxObstacle):
        lower, upper = np.array(shape.lower[:2]), np.array(shape.upper[:2])
        half = (upper - lower) / 2.0 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        c, s = math.cos(shape.rotation), math.sin(shape.rotation)
        corners: Array = (lower + upper) / 2.0 + half @ np.array([[c, s], [-s, c]])
        return corners
    return counter_clockwise(np.array(shape.vertices, dtype=np.float64))


def heights(shape: Obstacle | Zone) -> tuple[float, float]:
    """Heights of base and top above the floor [m]; a top of inf reaches the ceiling."""
    if isinstance(shape, CylinderObstacle):
        return shape.base, shape.height
    if isinstance(shape, BoxObstacle) and len(shape.lower) == 3:
        return shape.lower[2], shape.upper[2]
    if isinstance(shape, PolygonObstacle):
        return shape.base, math.inf if shape.height is None else shape.height
    return 0.0, math.inf


def half_planes(vertices: Array) -> tuple[Array, Array]:
    """Outward unit normals (E, 2) and offsets (E,) [m] of a convex polygon: inside is normal · x ≤ offset."""
    edge = np.roll(vertices, -1, axis=0) - vertices
    normal = np.stack([edge[:, 1], -edge[:, 0]], axis=1) / np.linalg.norm(edge, axis=1)[:, None]
    return normal, np.einsum("ea,ea->e", normal, vertices)


def counter_clockwise(vertices: Array) -> Array:
    """The same polygon, counter-clockwise."""
    x, y = vertices.T
    return vertices if float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) >= 0.0 else vertices[::-1].copy()


def _footprint_value(body: Solid, x: Array) -> Array:
    """Signed distance (...) of points (2, ...) to a convex polygon or a point."""
    if len(body.vertices) == 1:
        return np.asarray(np.hypot(x[0] - body.vertices[0, 0], x[1] - body.vertices[0, 1]))
    sides, points = body.sides, x.reshape(2, -1)
    off = sides.normals @ points
    off -= sides.offsets  # (E, ...) beyond each side's line
    past = sides.tangents @ points
    past -= sides.begins
    past -= np.minimum(np.maximum(past, 0.0), sides.lengths)  # of the side's ends
    beyond = off.max(axis=0)
    off *= off
    past *= past
    off += past
    value = np.where(beyond > 0.0, np.sqrt(off.min(axis=0)), beyond)
    return np.asarray(value.reshape(x.shape[1:]))


def _footprint_distance(body: Solid, x: Array) -> tuple[Array, Array]:
    """Signed distance (...) of points (2, ...) to a convex polygon or a point, and its gradient (2, ...)."""
    if len(body.vertices) == 1:
        delta = x - body.vertices[0].reshape(2, *(1,) * (x.ndim - 1))
        distance = np.hypot(*delta)
        outward = delta / np.where(distance > 0.0, distance, 1.0)
        outward[0][distance == 0.0] = 1.0  # from the very centre any way out is as good
        return distance, outward
    sides, points = body.sides, x.reshape(2, -1)
    off = sides.normals @ points - sides.offsets  # (E, M) beyond each side's line
    along = sides.tangents @ points - sides.begins
    past = along - np.minimum(np.maximum(along, 0.0), sides.lengths)  # of the side's ends
    most, nearest, each = off.argmax(axis=0), (off * off + past * past).argmin(axis=0), np.arange(points.shape[1])
    beyond, aside, past = off[most, each], off[nearest, each], past[nearest, each]
    away = sides.normals[nearest].T * aside + sides.tangents[nearest].T * past  # from the nearest point of all sides
    distance = np.hypot(aside, past)
    apart = (beyond > 0.0) & (distance > 0.0)
    outward = np.where(apart, away / np.where(apart, distance, 1.0), sides.normals[most].T)  # inside: the least depth
    return np.where(beyond > 0.0, distance, beyond).reshape(x.shape[1:]), outward.reshape(x.shape)
