"""How much of a camera's picture each point of a surface takes up.

A patch of area a at distance d, seen at an angle θ to its normal, takes up the solid angle a cos θ / d². Rays spread
evenly over the picture, cast until they hit (FEO, IV-D1), count just that, so this is what they converge to.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from missions.footprint import CameraFootprint
from missions.trajectory import FacingYaw, FixedYaw
from planner.surface.rays import Rays

ABOVE = 0.02  # [m] aside of what it faces, below which a robot has no direction to face


@dataclass(frozen=True)
class Camera:
    """A camera on a level robot.

    Attributes:
        lens: what it sees around its axis.
        yaw: where the axis points.
    """

    lens: CameraFootprint
    yaw: FacingYaw | FixedYaw

    def axes(self, x: Array, heading: Array | None = None) -> Array:
        """(M, 3) unit vectors along which it looks from x (M, 3) [m]; shorter right above what it faces.

        With headings (M,) [rad] where they say, not where they should.
        """
        if heading is not None:
            ahead = np.stack((np.cos(heading), np.sin(heading)), axis=1)
        elif isinstance(self.yaw, FixedYaw):
            ahead = np.tile([math.cos(self.yaw.angle), math.sin(self.yaw.angle)], (len(x), 1))
        else:
            arrow = np.asarray(self.yaw.point) - x[:, :2]
            ahead = arrow / np.maximum(np.linalg.norm(arrow, axis=1, keepdims=True), ABOVE)
        up = np.full((len(x), 1), math.sin(self.lens.pitch))
        return np.concatenate((math.cos(self.lens.pitch) * ahead, up), axis=1)

    def picture(self, rays: Rays, x: Array, heading: Array | None = None) -> Array:
        """(M, J) solid angle [sr] that every point's patch takes up in pictures from x (M, 3) [m], as far as seen."""
        seen = self.unobstructed(rays, x, heading)
        m, j = np.nonzero(seen)
        seen[m, j] *= rays.sees(x[m], j)
        return seen

    def unobstructed(self, rays: Rays, x: Array, heading: Array | None = None) -> Array:
        """The same as if nothing were in front of anything."""
        surface, lens = rays.surface, self.lens
        way = surface.points - x[:, None]  # (M, J, 3)
        distance = np.maximum(np.linalg.norm(way, axis=-1), 1e-9)
        facing = -np.einsum("mjd,jd->mj", way, surface.normals) / distance
        facing = np.abs(facing) if surface.two_sided else facing
        aside = np.arccos(np.clip(np.einsum("mjd,md->mj", way, self.axes(x, heading)) / distance, -1.0, 1.0))
        counts = (aside <= lens.half_angle) & (facing > max(math.cos(lens.grazing), 0.0))
        weight = lens.rim ** ((aside / lens.half_angle) ** 2) if lens.rim < 1.0 else 1.0
        if lens.reach is not None:
            weight = weight * np.exp(-0.5 * (distance / lens.reach) ** 2)
        return np.asarray(np.where(counts, weight * surface.area * facing / distance**2, 0.0))
