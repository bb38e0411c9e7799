"""Meshes and point clouds from files: PLY, OBJ and STL, as trimesh reads them.

Files come from anywhere: nothing but their geometry is looked at, sizes are bounded, and what cannot be looked at from
outside is refused in one line.
"""

from __future__ import annotations

import io
import struct
import warnings
from pathlib import PurePath
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array

MOST_FACES, MOST_POINTS = 200_000, 50_000
FEWEST_POINTS = 50  # of a cloud: fewer are no surface
FORMATS = ("ply", "obj", "stl")
NEIGHBOURS = 8  # of a point of a cloud, which tell where its surface lies
CLOSE = 4  # of them, which tell how far apart points are
OVERLAP = 1.6  # side of the square that a point of a cloud becomes, over the distance to its neighbours
_UNREADABLE = (  # whatever the library stumbles over in a file that is damaged, names it never bound included
    OSError, ValueError, TypeError, LookupError, AttributeError, NameError, ArithmeticError, EOFError, AssertionError,
    MemoryError, RuntimeError, ImportError, struct.error,
)  # fmt: skip


class MeshError(ValueError):
    """A file holds no surface that can be looked at."""


class Mesh(NamedTuple):
    """A surface in the file's own units.

    Attributes:
        vertices: (V, 3). faces: (F, 3) indices, counter-clockwise from outside.
        two_sided: made from points: which side of a face is outside is not known.
    """

    vertices: Array
    faces: NDArray[np.intp]
    two_sided: bool


def read_mesh(name: str, data: bytes) -> Mesh:
    """Read a closed surface, or a point cloud: points become little squares along the surface they lie on.

    Args:
        name: of the file; its ending says how it is read.
        data: contents of the file.

    Raises:
        MeshError: not readable, empty, too large, not closed, or inside out.
    """
    ending = PurePath(name).suffix.lower().lstrip(".")
    if ending not in FORMATS:
        raise MeshError(f"a file of type {ending[:20]!r}; allowed: {', '.join(FORMATS)}")
    geometry = _load(data, ending)
    vertices = np.asarray(getattr(geometry, "vertices", np.empty((0, 3))), dtype=np.float64).reshape(-1, 3)
    faces = np.asarray(getattr(geometry, "faces", np.empty((0, 3))), dtype=np.intp).reshape(-1, 3)
    if len(vertices) == 0:
        raise MeshError("empty: neither faces nor points")
    if not np.isfinite(vertices).all():
        raise MeshError("points with NaN or infinite coordinates; allowed: finite numbers")
    if len(faces) == 0:
        return _cloud(vertices)
    if len(faces) > MOST_FACES:
        raise MeshError(f"{len(faces)} faces; allowed: at most {MOST_FACES}; make it coarser")
    return _closed(geometry, vertices, faces)


def _load(data: bytes, ending: str) -> Any:  # noqa: ANN401 - a mesh or a point cloud of the library
    try:
        import trimesh
    except ImportError:
        raise MeshError("reading it takes trimesh and Embree: pip install 'ergoflie[objects]'") from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what matters is checked below
            parts = list(trimesh.load_scene(io.BytesIO(data), file_type=ending).geometry.values())
            if len(parts) == 1:
                geometry = parts[0]
            else:
                meshes = [part for part in parts if hasattr(part, "faces")]
                geometry = trimesh.util.concatenate(meshes) if meshes else trimesh.Trimesh()
            if hasattr(geometry, "faces"):
                geometry.merge_vertices(merge_tex=True, merge_norm=True)  # STL repeats every corner
    except _UNREADABLE as error:
        text = " ".join(str(error).split())[:80] or type(error).__name__
        raise MeshError(
            f"not a readable {ending.upper()} file ({''.join(c for c in text if c.isprintable())})"
        ) from None
    return geometry


def _closed(mesh: Any, vertices: Array, faces: NDArray[np.intp]) -> Mesh:  # noqa: ANN401
    if not mesh.is_watertight:
        edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        _, uses = np.unique(edges, axis=0, return_counts=True)
        wrong = int((uses != 2).sum())
        raise MeshError(
            f"not watertight: {wrong} edges without exactly two faces; allowed: a closed surface, or points only"
        )
    if not mesh.is_winding_consistent:
        raise MeshError("faces that disagree on which side is outside; allowed: one orientation")
    # Six times the volume, by tetrahedra from the first vertex: a sum of determinants.
    a, b, c = np.moveaxis(vertices[faces] - vertices[0], 1, 0)
    volume = float(np.einsum("fd,fd->", a, np.cross(b, c)))
    if volume == 0.0:
        raise MeshError("empty: a surface around nothing")
    return Mesh(vertices, faces if volume > 0.0 else faces[:, ::-1].copy(), two_sided=False)


def _cloud(points: Array) -> Mesh:
    """A square for each point, across the direction in which its neighbours spread least."""
    from scipy.spatial import cKDTree

    points = np.unique(points, axis=0)
    if not FEWEST_POINTS <= len(points) <= MOST_POINTS:
        raise MeshError(f"{len(points)} points; allowed: {FEWEST_POINTS} to {MOST_POINTS}")
    distance, near = cKDTree(points).query(points, k=NEIGHBOURS + 1)
    around = points[near] - points[near].mean(axis=1, keepdims=True)
    _, axes = np.linalg.eigh(np.einsum("pna,pnb->pab", around, around))  # least spread first
    half = 0.5 * OVERLAP * distance[:, 1 : 1 + CLOSE].mean(axis=1)[:, None]
    u, v = half * axes[:, :, 1], half * axes[:, :, 2]
    corners = np.stack((points - u - v, points + u - v, points + u + v, points - u + v), axis=1)
    first = 4 * np.arange(len(points))[:, None, None]
    faces = (first + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
    return Mesh(corners.reshape(-1, 3), faces, two_sided=True)
