"""A cone fixed to the body: the camera tilts as the drone accelerates, and what it sees is an ellipse to one side.

Attitude comes from the flat outputs: the body's vertical is along a + g (Mellinger and Kumar 2011). Acceleration is the
second difference of the positions, so that plans, polynomials and flights are all looked at in the same way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.footprint.outline import LOWEST, Cast

GRAVITY = 9.81
FLATTEST = 0.05  # least cosine of the angle between ground normal and the cone's lowest ray: beyond, the cone sees far


@dataclass(frozen=True)
class TiltedCone:
    """An outline: where a cone around the body's downward axis meets the ground.

    Attributes:
        half_angle: of the cone [rad]. dt: time between positions [s]; motions start and end at rest.
    """

    half_angle: float
    dt: float

    def __post_init__(self) -> None:
        if not 0.0 < self.half_angle < 0.5 * math.pi or self.dt <= 0.0:
            raise ValueError(f"a cone needs an angle in (0, π/2) and dt > 0; got {self.half_angle} rad and {self.dt} s")

    def cast(self, x: Array, direction: Array) -> Cast:
        """See :class:`~planner.footprint.outline.Outline`."""
        b = _accelerations(x, self.dt).reshape(-1, 3)
        b[:, 2] += GRAVITY
        height = np.maximum(x[..., 2].ravel(), LOWEST)
        size, b_z = np.linalg.norm(b, axis=-1), b[:, 2]
        e = np.stack((np.cos(direction), np.sin(direction)), axis=-1)
        s, c = math.sin(self.half_angle), math.cos(self.half_angle)
        mu = -(b[:, :2] @ e.T) / size[:, None]  # (M, P) cosine between the axis and each direction on the ground
        level = np.sqrt(1.0 - mu**2)
        spread = np.maximum(c * level - s * mu, FLATTEST * s)
        D, rho = height * size / b_z, s / spread
        centre = x[..., :2].reshape(-1, 2) - (height / b_z)[:, None] * b[:, :2]

        def pull(by_centre: Array, by_radius: Array) -> Array:
            by_D = np.einsum("mp,mp->m", by_radius, rho)
            free = c * level - s * mu > FLATTEST * s
            by_mu = by_radius * D[:, None] * rho**2 / s * (c * mu / level + s) * free
            aside = np.einsum("md,md->m", by_centre, b[:, :2]) / b_z
            by_b = (by_D * height / (size * b_z) - np.einsum("mp,mp->m", by_mu, mu) / size**2)[:, None] * b
            by_b[:, 2] += (-by_D * size / b_z + aside) * height / b_z
            by_b[:, :2] -= by_mu @ e / size[:, None] + by_centre * (height / b_z)[:, None]
            gradient = _pull_accelerations(by_b.reshape(x.shape), self.dt)
            gradient[..., :2] += by_centre.reshape(*x.shape[:-1], 2)
            lifted = x[..., 2] > LOWEST
            gradient[..., 2] += (by_D * size / b_z - aside).reshape(x.shape[:-1]) * lifted
            return gradient

        return Cast(centre, D[:, None] * rho, pull)


def _accelerations(x: Array, dt: float) -> Array:
    """Second differences (T, N, 3) [m/s²] of positions that stand still before and after."""
    step = np.diff(x, axis=0)
    rest = np.zeros((1, *x.shape[1:]))
    difference: Array = np.diff(np.concatenate((rest, step, rest)), axis=0) / dt**2
    return difference


def _pull_accelerations(by_acceleration: Array, dt: float) -> Array:
    """Transpose of :func:`_accelerations`, which is symmetric."""
    return _accelerations(by_acceleration, dt)
