"""A thing that stands in the workspace and is looked at from all sides: the mission's object.

The information lies on its surface, robots look at it with cameras (FEO, IV-D), and it is in everybody's way. What a
file says becomes a :class:`Surface` when the mission is read (:mod:`missions.placing`).
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array, frozen
from missions.fields import Vector, field

FEWEST_SAMPLES, MOST_SAMPLES = 50, 5000


@dataclass(frozen=True, eq=False)
class Surface:
    """A placed surface, in the world frame; one is only ever equal to itself.

    Attributes:
        vertices: (V, 3) [m]. faces: (F, 3) indices of vertices, counter-clockwise from outside.
        points: (J, 3) [m] all over the surface; each stands for as much of it.
        normals: (J, 3) outward unit vectors.
        area: what a point stands for [m²].
        share: (J,) of the information, 1 in all.
        face: (J,) index of the face each point is on.
        two_sided: what is inside and what outside is not known, because the file holds points only.
    """

    vertices: Array
    faces: NDArray[np.intp]
    points: Array
    normals: Array
    area: float
    share: Array
    face: NDArray[np.intp]
    two_sided: bool = False

    def __post_init__(self) -> None:
        for name in ("vertices", "points", "normals", "share"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        for array in (self.faces, self.face):
            array.setflags(write=False)

    @property
    def lower(self) -> Array:
        """(3,) lower corner of the box around it [m]."""
        return np.asarray(self.vertices.min(axis=0))

    @property
    def upper(self) -> Array:
        """(3,) and the upper."""
        return np.asarray(self.vertices.max(axis=0))

    @property
    def centre(self) -> tuple[float, float]:
        """(x, y) of the box's centre [m]: what robots look at."""
        x, y = 0.5 * (self.lower + self.upper)[:2]
        return float(x), float(y)


@dataclass(frozen=True)
class InspectedObject:
    """What is looked at: a surface from a file, placed in the workspace."""

    file: str = field("closed surface or point cloud: a PLY, OBJ or STL file, relative to the mission file")
    near: float = field(
        "h_3: distance that robots' centres keep from it, always: add their size", unit="m", above=0.0, at_most=10.0
    )
    far: float | None = field(
        "h_2: distance from it that robots do not exceed while they search; default: any",
        unit="m",
        above=0.0,
        at_most=100.0,
        default=None,
    )
    position: Vector = field("where the file's origin is put", unit="m", items=(3, 3), default=(0.0, 0.0, 0.0))
    yaw: float = field(
        "turn about the vertical, counter-clockwise from above",
        unit="rad",
        at_least=-6.2832,
        at_most=6.2832,
        default=0.0,
    )
    scale: float = field(
        "metres per unit of the file, e.g. 0.001 for millimetres", unit="m", above=0.0, at_most=1e4, default=1.0
    )
    facing: Vector | None = field(
        "(x, y, z) direction: the information falls with the cosine to it and is nil on what faces away; default: all "
        "sides alike",
        items=(3, 3),
        default=None,
    )
    samples: int = field(
        "points on the surface at which it is looked at", at_least=FEWEST_SAMPLES, at_most=MOST_SAMPLES, default=500
    )
    surface: Surface | None = dataclasses.field(default=None, repr=False, compare=False, metadata={"internal": True})
