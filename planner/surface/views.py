"""Looks from all over the workspace, and from anywhere in between.

At the nodes of a grid of viewpoints, rays say what is seen. In between, and at the nodes too, a look is the mean of
those around, weighted by quadratic B-splines: weights are positive and 1 in all, so it is a look again, and it changes
smoothly although a ray either hits or does not. It is what is seen from about here; as the grid becomes finer, from
here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.surface.camera import Camera
from planner.surface.rays import Rays

NODES = 5000  # of the grid, about
FINEST = 0.08  # [m] between them: closer is finer than robots follow
FAINT = 1e-4  # [sr] of surface in the picture that is as good as nothing
ROWS = 256  # viewpoints at once


@dataclass(frozen=True)
class Grid:
    """Viewpoints all over a box, one step beyond it on every side.

    Attributes:
        lower: (3,) corner of the box [m]. upper: (3,) and the other.
        cells: of the box along each axis.
    """

    lower: Array
    upper: Array
    cells: tuple[int, int, int]

    @classmethod
    def over(cls, lower: Array, upper: Array, nodes: int = NODES) -> Grid:
        """About so many viewpoints, as far apart along every axis."""
        side = upper - lower
        step = max(FINEST, float(side.prod() / nodes) ** (1.0 / 3.0))
        x, y, z = (max(1, math.ceil(float(length) / step)) for length in side)
        return cls(lower, upper, (x, y, z))

    @property
    def shape(self) -> tuple[int, int, int]:
        """Viewpoints along each axis."""
        x, y, z = self.cells
        return x + 3, y + 3, z + 3

    @property
    def step(self) -> Array:
        """(3,) between viewpoints [m]."""
        return np.asarray((self.upper - self.lower) / np.array(self.cells))

    def nodes(self) -> Array:
        """(G, 3) viewpoints [m], the last axis fastest."""
        axes = [low + h * (np.arange(n) - 1) for low, h, n in zip(self.lower, self.step, self.shape, strict=True)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)

    def blends(self, x: Array) -> Blends:
        """Which viewpoints count how much at x (M, 3) [m]; from beyond the box it is looked at from its edge."""
        inside = np.clip(x, self.lower, self.upper)
        u = (inside - self.lower) / self.step
        nearest = np.rint(u)
        s = u - nearest  # in [−½, ½]
        weight = np.stack((0.5 * (0.5 - s) ** 2, 0.75 - s * s, 0.5 * (0.5 + s) ** 2), axis=1)
        slope = np.stack((s - 0.5, -2.0 * s, s + 0.5), axis=1) * ((inside == x) / self.step)[:, None]
        _, n_y, n_z = self.shape
        stride = np.array([n_y * n_z, n_z, 1])
        around = np.arange(3)
        offset = (around[:, None, None] * n_y + around[:, None]) * n_z + around
        return Blends(nearest.astype(np.intp) @ stride, offset.ravel(), weight, slope)


@dataclass(frozen=True)
class Blends:
    """How looks from M positions are made of those from 3³ viewpoints around each.

    Attributes:
        first: (M,) index of the first of them. offset: (27,) of the others from it.
        weight: (M, 3, 3) of three along each axis (last), 1 in all. slope: (M, 3, 3) their derivatives [1/m].
    """

    first: NDArray[np.intp]
    offset: NDArray[np.intp]
    weight: Array
    slope: Array

    def gathered(self, swarms: int, nodes: int) -> Array:
        """(B, nodes) sums of the shares that viewpoints have in the looks of each of B swarms."""
        a, b, c = np.moveaxis(self.weight, -1, 0)
        shares = ((a[:, :, None] * b[:, None]).reshape(-1, 9, 1) * c[:, None]).reshape(swarms, -1)
        index = (self.first[:, None] + self.offset).reshape(swarms, -1)
        return np.stack([np.bincount(i, s, nodes) for i, s in zip(index, shares, strict=True)])

    def gradient(self, field: Array) -> Array:
        """(M, 3) [1/m] of what is given at viewpoints, blended: (B, nodes) for B swarms of M/B positions each."""
        swarms, nodes = field.shape
        index = self.first.reshape(swarms, -1) + (nodes * np.arange(swarms))[:, None]
        values = field.ravel()[index.reshape(-1, 1) + self.offset].reshape(-1, 9, 3)
        (a, b, c), (da, db, dc) = np.moveaxis(self.weight, -1, 0), np.moveaxis(self.slope, -1, 0)
        along_z = (values @ np.stack((c, dc), axis=-1)).reshape(-1, 3, 3, 2)
        along_y = np.einsum("mabk,mb->mak", along_z, b)
        by_y = np.einsum("ma,mb,mab->m", a, db, along_z[..., 0])
        by_x, by_z = np.einsum("ma,ma->m", da, along_y[..., 0]), np.einsum("ma,ma->m", a, along_y[..., 1])
        return np.stack((by_x, by_y, by_z), axis=-1)


def looks(camera: Camera, rays: Rays, x: Array) -> Array:
    """(M, J) densities over the surface's points of looks from x (M, 3) [m]: 1 in all, or less where little is seen.

    FEO, Definition 1, but for what looks past the object: it sees nothing, and E pays for it.
    """
    out = np.empty((len(x), len(rays.surface.points)))
    for first in range(0, len(x), ROWS):
        picture = camera.picture(rays, x[first : first + ROWS])
        out[first : first + ROWS] = picture / (picture.sum(axis=1, keepdims=True) + FAINT)
    return out
