"""Statistics of any star-shaped footprint, clipped at the workspace's edge, by quadrature in polar coordinates.

Directions are equally spaced (of spectral accuracy while the edge is not met), distances at Gauss's nodes. What lies
beyond the workspace is not seen, and what is seen counts for one whole look (FEO, Definition 1: the density's integral
over the workspace is 1). Gradients are those of the quadrature itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from missions.arrays import Array
from planner.ergodic.basis import CosineBasis
from planner.footprint.base import Look, Seen, gauss, weighted_statistics
from planner.footprint.outline import Outline

DIRECTIONS, RINGS = 64, 5  # clipped discs are then exact to 2e-3, others to 1e-9
NEAREST = 1e-6  # [m] the least reach: at the very edge, directions across it see nothing


@dataclass(frozen=True)
class PolarFootprint:
    """A footprint by its outline.

    Attributes:
        outline: of the region seen.
        rim: weight of the sensor at the outline, of that at the centre: Gaussian in between; 1: the same everywhere.
        directions: P. rings: nodes from the centre outwards.
    """

    outline: Outline
    rim: float = 1.0
    directions: int = DIRECTIONS
    rings: int = RINGS

    def __post_init__(self) -> None:
        if not 0.0 < self.rim <= 1.0:
            raise ValueError(f"a footprint's rim weighs more than 0 and at most 1; got {self.rim}")

    def look(self, basis: CosineBasis, x: Array) -> Look:
        """See :class:`~planner.footprint.base.Footprint`."""
        psi, e = self._directions()
        cast = self.outline.cast(x, psi)
        inside = np.clip(cast.centre, basis.lower, basis.upper)
        clip = _clip(basis, inside, cast.radius, e)
        samples = self._samples(inside, clip.reach, cast.radius, e)
        c_k, field = weighted_statistics(
            basis, samples.points.reshape(-1, 2), samples.weights.ravel() / len(cast.centre)
        )

        def pull(weights: Array) -> Array:
            by_centre, by_reach, by_radius = samples.pull(field(weights), len(cast.centre))
            by_centre += np.einsum("mp,mpd->md", by_reach, clip.by_centre)
            by_centre *= inside == cast.centre  # from beyond the edge, the nearest point is looked at
            return cast.pull(by_centre, by_radius + by_reach * clip.whole)

        return Look(c_k, pull)

    def each(self, basis: CosineBasis, x: Array) -> Array:
        """See :class:`~planner.footprint.base.Footprint`: outlines are those of the whole motion."""
        psi, e = self._directions()
        cast = self.outline.cast(x, psi)
        inside = np.clip(cast.centre, basis.lower, basis.upper)
        samples = self._samples(inside, _clip(basis, inside, cast.radius, e).reach, cast.radius, e)
        points, weights = (
            part.reshape(len(x), -1, *part.shape[3:]) for part in (samples.points, samples.weights / x.shape[1])
        )
        return np.stack([weighted_statistics(basis, *step)[0] for step in zip(points, weights, strict=True)])

    def _directions(self) -> tuple[Array, Array]:
        """(P,) [rad] and as unit vectors (P, 2)."""
        psi = 2.0 * math.pi * (np.arange(self.directions) + 0.5) / self.directions
        return psi, np.stack((np.cos(psi), np.sin(psi)), axis=-1)

    def _samples(self, centre: Array, reach: Array, radius: Array, e: Array) -> _Samples:
        s, weight = gauss(self.rings)  # (J,) share of the reach
        share = s * (reach / radius)[..., None]  # (M, P, J) of the outline's radius
        density = s * weight * reach[..., None] ** 2
        if self.rim < 1.0:
            density = density * self.rim ** (share**2)
        total = density.sum(axis=(1, 2), keepdims=True)
        points = centre[:, None, None] + (s * reach[..., None])[..., None] * e[:, None]
        slope = 2.0 * math.log(self.rim) * share**2  # d ln density / d ln share
        return _Samples(points, density / total, s, e, reach, radius, slope)


class _Samples(NamedTuple):
    """Points (M, P, J, 2) [m] and weights (M, P, J), 1 in all for each look, and what their derivatives take."""

    points: Array
    weights: Array
    s: Array
    e: Array
    reach: Array
    radius: Array
    slope: Array

    def pull(self, field: Seen, looks: int) -> tuple[Array, Array, Array]:
        """Gradients by centre (M, 2), reach (M, P) and radius (M, P) of the field's mean over the samples."""
        value = field.value.reshape(self.weights.shape)
        gradient = field.gradient.reshape(self.points.shape)  # of the value, not weighted
        shared = self.weights / looks
        mean = np.einsum("mpj,mpj->m", self.weights, value)
        by_log_density = shared * (value - mean[:, None, None])
        moved = shared[..., None] * gradient
        along = np.einsum("mpjd,pd->mpj", moved, self.e)
        by_share = np.einsum("mpj,mpj->mp", by_log_density, self.slope)
        by_reach = (2.0 * by_log_density.sum(axis=-1) + by_share) / self.reach + along @ self.s
        return moved.sum(axis=(1, 2)), by_reach, -by_share / self.radius


class _Clip(NamedTuple):
    """How far one sees before the workspace ends.

    Attributes:
        reach: (M, P) [m]. whole: (M, P) whether the outline comes first.
        by_centre: (M, P, 2) derivative of the reach where it ends at the edge.
    """

    reach: Array
    whole: Array
    by_centre: Array


def _clip(basis: CosineBasis, centre: Array, radius: Array, e: Array) -> _Clip:
    ahead = np.where(e > 0.0, basis.upper, basis.lower)  # (P, 2) the edge that each direction meets
    with np.errstate(divide="ignore", invalid="ignore"):
        to_edge = np.nan_to_num((ahead - centre[:, None]) / e, nan=math.inf, posinf=math.inf)  # (M, P, 2)
    axis = np.argmin(to_edge, axis=-1, keepdims=True)
    edge = np.maximum(np.take_along_axis(to_edge, axis, axis=-1)[..., 0], NEAREST)
    whole = radius <= edge
    moves = (np.arange(2) == axis) & ~whole[..., None] & (edge > NEAREST)[..., None]
    with np.errstate(divide="ignore"):
        by_centre = np.where(moves, -1.0 / e, 0.0)
    return _Clip(np.minimum(radius, edge), whole.astype(np.float64), by_centre)
