"""How close a curve comes to a convex solid, with proof: branch and bound over supporting half-spaces.

For any unit vector n the solid lies in the half-space n · x ≤ h(n), h being its support function, so a point q is at
least n · q − h(n) away from it (and at most that deep inside, up to sign). Along a piece of curve this is a polynomial,
bounded below by its smallest Bernstein coefficient. Where n comes from does not matter to the proof; the bound is
tight if n points from the solid to the curve, so it is the gradient of the distance at points of the piece.
"""

from __future__ import annotations

import numpy as np

from missions.arrays import Array
from missions.shapes import Solid
from planner.certificate.bernstein import ROUNDING, Minimum
from planner.certificate.branching import smallest


def closest(points: Array, start: Array, end: Array, solid: Solid, resolution: float) -> Minimum:
    """Smallest signed distance of a curve to a solid [m]; one group.

    Args:
        points: (B, 3, n+1) Bernstein coefficients of the curve's pieces [m].
        start: (B,) times of the pieces' beginnings [s].
        end: (B,) and ends [s].
        solid: the solid.
        resolution: largest gap between bound and attained [m].
    """

    def look(points: Array) -> tuple[Array, Array]:
        distance = solid.distance(np.moveaxis(points[..., [0, -1]], 1, 0))
        directions = (solid.distance(points.mean(axis=-1).T).gradient, *np.moveaxis(distance.gradient, -1, 0))
        low = np.fmax.reduce([_lowest(points, n, solid) for n in directions])
        low[np.isnan(low)] = -np.inf  # no direction, no bound
        return distance.value, low

    return smallest(points, start, end, look, resolution)


def _lowest(points: Array, n: Array, solid: Solid) -> Array:
    """(B,) lower bounds of the distance of pieces (B, 3, k) by half-spaces with normals n (3, B) of any length."""
    with np.errstate(invalid="ignore", divide="ignore"):
        n = n / np.linalg.norm(n, axis=0)
    along = np.einsum("ab,baj->bj", n, points)
    size = np.abs(points).max(axis=(1, 2))
    return np.asarray(along.min(axis=1) - _support(solid, n) - ROUNDING * size)


def _support(solid: Solid, n: Array) -> Array:
    """h(n): how far the solid reaches along unit vectors n (3, B); inf along a side that has no end."""
    aside = np.max(solid.vertices @ n[:2], axis=0) + solid.radius * np.hypot(n[0], n[1])
    up, down = np.maximum(n[2], 0.0), np.maximum(-n[2], 0.0)
    top = np.where(up > 0.0, up * (solid.high if np.isfinite(solid.high) else 0.0), 0.0)
    base = np.where(down > 0.0, -down * (solid.low if np.isfinite(solid.low) else 0.0), 0.0)
    endless = ((up > 0.0) & np.isinf(solid.high)) | ((down > 0.0) & np.isinf(solid.low))
    return np.where(endless, np.inf, aside + top + base)
