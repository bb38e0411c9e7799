"""Windows parallel to the workspace's axes in closed form, edges included: a product of one integral an axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.ergodic.basis import CosineBasis
from planner.footprint.base import Look, step_by_step
from planner.footprint.outline import LOWEST

THINNEST = 1e-9  # of the box: what is left of a window that looks past the edge


@dataclass(frozen=True)
class WindowFootprint:
    """A level camera's rectangular picture, its length along x.

    Attributes:
        slopes: half its length (x) and width (y) on the ground per metre of height.
    """

    slopes: tuple[float, float]

    def __post_init__(self) -> None:
        if min(self.slopes) <= 0.0:
            raise ValueError(f"a window needs slopes above 0; got {self.slopes}")

    def look(self, basis: CosineBasis, x: Array) -> Look:
        """See :class:`~planner.footprint.base.Footprint`."""
        flat = x.reshape(-1, 3)
        height = np.maximum(flat[:, 2], LOWEST)
        grows = flat[:, 2] > LOWEST
        means, by_centre, by_height = zip(
            *(_mean_cosines(basis, d, flat[:, d], height, self.slopes[d]) for d in range(2)), strict=True
        )
        scale = 1.0 / (len(flat) * basis.h_k)
        c_k: Array = means[0] @ means[1].T * scale

        def pull(weights: Array) -> Array:
            G = weights * scale
            by_mean = (G @ means[1], G.T @ means[0])  # (n, M): of the means along x and along y
            gradient = np.empty(flat.shape)
            for d in range(2):
                gradient[:, d] = np.einsum("km,km->m", by_mean[d], by_centre[d])
            gradient[:, 2] = grows * sum(np.einsum("km,km->m", by_mean[d], by_height[d]) for d in range(2))
            return gradient.reshape(x.shape)

        return Look(c_k, pull)

    def each(self, basis: CosineBasis, x: Array) -> Array:
        """See :class:`~planner.footprint.base.Footprint`."""
        return step_by_step(self, basis, x)


def _mean_cosines(
    basis: CosineBasis, axis: int, centre: Array, height: Array, slope: float
) -> tuple[Array, Array, Array]:
    """Mean of cos kθ over a window's extent along an axis, (n, M), and its derivatives by centre and height [1/m]."""
    lower, side = basis.lower[axis], basis.upper[axis] - basis.lower[axis]
    w, half = (centre - lower) / side, slope * height / side
    left, right = np.clip(w - half, 0.0, 1.0 - THINNEST), np.clip(w + half, THINNEST, 1.0)
    moves_left, moves_right = (w - half > 0.0) & (w - half < 1.0 - THINNEST), (w + half < 1.0) & (w + half > THINNEST)
    k = np.arange(basis.n)[:, None] * np.pi
    extent = right - left
    middle, spread = 0.5 * (left + right), 0.5 * extent
    mean = np.cos(k * middle) * np.sinc(k * spread / np.pi)
    by_left, by_right = (mean - np.cos(k * left)) / extent, (np.cos(k * right) - mean) / extent
    by_w = by_left * moves_left + by_right * moves_right
    by_half = by_right * moves_right - by_left * moves_left
    return mean, by_w / side, by_half * (slope / side)
