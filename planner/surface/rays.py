"""What is seen from where, by casting rays at a surface: Embree's hierarchy of boxes, all rays at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from missions.objects import Surface
from planner.errors import PlannerError

BEHIND = 1e-3  # [m] that a ray may fall short of a point and still see it
BATCH = 500_000  # rays at once: 50 MB


class Rays:
    """A surface that rays are cast at.

    Args:
        surface: what they hit.

    Raises:
        PlannerError: no library to cast them with. (trimesh's own way, without Embree, takes a second for a thousand.)
    """

    def __init__(self, surface: Surface) -> None:
        try:
            import trimesh
            from trimesh.ray.ray_pyembree import RayMeshIntersector
        except ImportError:
            raise PlannerError("casting rays takes trimesh and Embree: pip install 'ergoflie[objects]'") from None
        self.surface = surface
        mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False, validate=False)
        self._caster: Any = RayMeshIntersector(mesh)
        corner = surface.vertices[surface.faces]
        self._corner = corner[:, 0]
        self._across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        # The squares that points of a cloud become overlap: they do not hide one another by less than their size.
        side = float(np.sqrt(np.median(np.linalg.norm(self._across, axis=1))))
        self._behind = side if surface.two_sided else BEHIND

    def sees(self, x: Array, points: NDArray[np.intp]) -> NDArray[np.bool_]:
        """(R,) whether nothing is between positions x (R, 3) [m] and the surface's points of these numbers (R,)."""
        out = np.empty(len(x), dtype=np.bool_)
        for first in range(0, len(x), BATCH):
            rays = slice(first, first + BATCH)
            way = self.surface.points[points[rays]] - x[rays]
            out[rays] = self.first_hit(x[rays], way) >= 1.0 - self._behind / np.linalg.norm(way, axis=1)
        return out

    def first_hit(self, x: Array, way: Array) -> Array:
        """(R,) how far rays from x (R, 3) get along their ways (R, 3) [m], as a share of them; inf if past all."""
        face = np.asarray(self._caster.intersects_first(x, way))
        hit = face >= 0
        across = self._across[face]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.einsum("rd,rd->r", self._corner[face] - x, across) / np.einsum("rd,rd->r", way, across)
        return np.where(hit, share, np.inf)
