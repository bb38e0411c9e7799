"""What is in the way of one robot, as convex prisms: a straight move is clear of them or not, in closed form.

A prism is an intersection of half-spaces that holds an obstacle grown by some clearance: one for each side of its
footprint, one for each corner of it (so that growing leaves no spike there), top and base. Circles get tangents; 96 of
them lie within 0.05 % of the circle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from missions.shapes import Solid, half_planes

_TANGENTS = 96  # of a circle that is stayed out of
_CORNERS = 12  # of a circle that is flown around
_BESIDE = 1e-3  # [m] how far from a prism's edges the ways around it run
_TOUCHING = 1e-9  # [m] a move along a side is outside


@dataclass(frozen=True)
class Prism:
    """A convex set {x: normals · x ≤ offsets} that nobody enters.

    Attributes:
        label: what it is in the mission file, e.g. ``obstacles[2]``.
        normals: (E, 3) unit vectors.
        offsets: (E,) [m].
        corners: (C, 2) points just outside, seen from above, from corner to corner of which it can be flown around [m].
        heights: heights just below and just above it [m]; none for what reaches from floor to ceiling.
    """

    label: str
    normals: Array
    offsets: Array
    corners: Array
    heights: tuple[float, ...]

    def depth(self, point: Array) -> float:
        """How deep a point (3,) is inside [m]; negative outside, no farther than the true distance."""
        return float((self.offsets - self.normals @ point).min())

    def hits(self, begin: Array, ends: Array) -> NDArray[np.bool_]:
        """(M,) which straight moves from one point (3,) to others (M, 3) enter it."""
        outside = self.normals @ begin - self.offsets  # (E,) positive beyond a side
        slope = (ends - begin) @ self.normals.T  # (M, E)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            crossing = -outside / slope
        enter = np.where(slope < 0.0, crossing, np.where((slope == 0.0) & (outside >= 0.0), np.inf, -np.inf))
        leave = np.where(slope > 0.0, crossing, np.inf)
        first, last = np.maximum(enter.max(axis=1), 0.0), np.minimum(leave.min(axis=1), 1.0)
        return np.asarray(first < last)


def grown(label: str, solid: Solid, clearance: float, given: Array) -> Prism:
    """A solid grown by a clearance, or by as much less as leaves the given points outside.

    Args:
        label: what it is.
        solid: what is stayed out of.
        clearance: to keep from it [m].
        given: (G, 3) points that a robot starts from or goes to [m].
    """
    normals, offsets = _sides(solid, clearance)
    depth = max(float((offsets - normals @ point).min()) for point in given)
    less = max(0.0, depth) + _TOUCHING
    corners = _corners(solid, clearance + _BESIDE)
    heights = (solid.low - clearance - _BESIDE, solid.high + clearance + _BESIDE)
    return Prism(label, normals, offsets - less, corners, tuple(z for z in heights if math.isfinite(z)))


def _sides(solid: Solid, clearance: float) -> tuple[Array, Array]:
    """Half-spaces (E, 3), (E,) of a solid grown by a clearance [m]."""
    aside, offsets = _footprint(solid, clearance, _TANGENTS)
    normals = np.column_stack([aside, np.zeros(len(aside))])
    for direction, height in ((1.0, solid.high), (-1.0, -solid.low)):
        if math.isfinite(height):
            normals = np.vstack([normals, [0.0, 0.0, direction]])
            offsets = np.append(offsets, height + clearance)
    return normals, offsets


def _footprint(solid: Solid, clearance: float, tangents: int) -> tuple[Array, Array]:
    """Half-planes (E, 2), (E,) of a grown footprint, in the order of their directions."""
    if len(solid.vertices) == 1:
        angle = np.arange(tangents) * (2.0 * math.pi / tangents)
        normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return normals, normals @ solid.vertices[0] + solid.radius + clearance
    sides, offsets = half_planes(solid.vertices)
    bevels = sides + np.roll(sides, 1, axis=0)  # at the vertex before each side
    bevels /= np.linalg.norm(bevels, axis=1)[:, None]
    at_vertices = np.einsum("va,va->v", bevels, solid.vertices)
    normals = np.stack([bevels, sides], axis=1).reshape(-1, 2)
    together = np.stack([at_vertices, offsets], axis=1).ravel()
    return normals, together + solid.radius + clearance


def _corners(solid: Solid, clearance: float) -> Array:
    """(C, 2) where neighbouring half-planes of a grown footprint meet [m]."""
    if len(solid.vertices) == 1:
        normals, _ = _footprint(solid, clearance, _CORNERS)
        return np.asarray(solid.vertices[0] + _met(normals, np.roll(normals, -1, axis=0), solid.radius + clearance))
    bevels, sides = np.moveaxis(_footprint(solid, clearance, _TANGENTS)[0].reshape(-1, 2, 2), 1, 0)
    before = np.roll(sides, 1, axis=0)
    out = [solid.vertices + _met(bevels, side, solid.radius + clearance) for side in (before, sides)]
    return np.stack(out, axis=1).reshape(-1, 2)


def _met(a: Array, b: Array, distance: float) -> Array:
    """Where pairs of lines with unit normals (C, 2) meet that pass the origin at the same distance [m]."""
    return np.asarray(distance * (a + b) / (1.0 + np.einsum("ca,ca->c", a, b))[:, None])
