"""Discs in closed form: a disc's coefficient is its centre's times a Bessel factor of its radius.

∫ F_k over a uniform disc of radius r around q = F_k(q) · 2 J₁(κ_k r)/(κ_k r), κ_k = π √(Σ_d (k_d/L_d)²): exact, as long
as the disc is inside the workspace; those that reach over its edge are clipped (:mod:`~planner.footprint.clipped`). A
weight that falls with distance changes the factor only. As functions of the radius, all factors of a basis are sums of
a few Chebyshev polynomials of r², so statistics are products of small matrices.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from missions.arrays import Array, frozen
from planner.ergodic.basis import CosineBasis
from planner.footprint.base import Footprint, Look, gauss, step_by_step
from planner.footprint.clipped import ClippedDisc
from planner.footprint.outline import Disc
from planner.footprint.polar import PolarFootprint

RINGS = 48  # nodes of the factor's integral where the weight falls with distance: exact to rounding
FLAT = 1e-7  # least sin θ: at the ends of [−1, 1] derivatives are limits
EXTRA_NODES = 24  # of the factor's integrals, beyond z
NEGLIGIBLE = 1e-13  # Chebyshev coefficients below this change no digit


@dataclass(frozen=True)
class DiscFootprint:
    """A disc, of one size or growing with height.

    Attributes:
        disc: its size. rim: weight at its outline, of that at its centre; 1: the same everywhere.
    """

    disc: Disc
    rim: float = 1.0

    def look(self, basis: CosineBasis, x: Array) -> Look:
        """See :class:`~planner.footprint.base.Footprint`."""
        flat = x.reshape(-1, 1, 3)
        centre, radius = flat[:, 0, :2], self.disc.size(flat[:, 0, 2])
        room = np.minimum(centre - basis.lower, basis.upper - centre).min(axis=-1)
        inside = radius <= room
        parts = [(inside, self._whole(basis, flat[inside]))] if inside.any() else []
        if not inside.all():
            parts.append((~inside, self._clipped().look(basis, flat[~inside])))
        share = [float(mask.mean()) for mask, _ in parts]
        c_k = sum((part * look.c_k for part, (_, look) in zip(share, parts, strict=True)), np.zeros((basis.n,) * 2))

        def pull(weights: Array) -> Array:
            gradient = np.empty(flat.shape)
            for part, (mask, look) in zip(share, parts, strict=True):
                gradient[mask] = look.pull(part * weights)
            return gradient.reshape(x.shape)

        return Look(c_k, pull)

    def each(self, basis: CosineBasis, x: Array) -> Array:
        """See :class:`~planner.footprint.base.Footprint`."""
        return step_by_step(self, basis, x)

    def _clipped(self) -> Footprint:
        return ClippedDisc(self.disc) if self.rim == 1.0 else PolarFootprint(self.disc, self.rim)

    def _whole(self, basis: CosineBasis, x: Array) -> Look:
        """Discs inside the workspace, at x (M, 1, 3)."""
        points, height = x[:, 0, :2], x[:, 0, 2]
        radius = self.disc.size(height)
        A, largest = _factors(basis.n, *(basis.upper - basis.lower), self.rim, _halvings(basis, float(radius.max())))
        T, T_rate = _chebyshev(2.0 * (radius / largest) ** 2 - 1.0, len(A))  # (D, M)
        tables = basis.tables(points)
        (C_x, C_y), (S_x, S_y) = tables.cosine.swapaxes(0, 1), tables.sine.swapaxes(0, 1)
        scale = A / (len(x) * basis.h_k)  # (D, n, n)
        D, n = len(A), basis.n
        weighted = (T[:, None] * C_x).reshape(D * n, -1)
        c_k: Array = (scale * (weighted @ C_y.T).reshape(D, n, n)).sum(axis=0)

        def pull(weights: Array) -> Array:
            W = scale * weights
            along_y = (W.reshape(D * n, n) @ C_y).reshape(D, n, -1)
            along_x = (W.swapaxes(1, 2).reshape(D * n, n) @ C_x).reshape(D, n, -1)
            k = np.arange(n, dtype=np.float64)[:, None]
            gradient = np.empty((len(x), 1, 3))
            gradient[:, 0, 0] = (k * S_x * np.einsum("dm,dam->am", T, along_y)).sum(axis=0)
            gradient[:, 0, 1] = (k * S_y * np.einsum("dm,dbm->bm", T, along_x)).sum(axis=0)
            gradient[:, 0, :2] *= -np.pi / (basis.upper - basis.lower)
            by_radius = (C_x * np.einsum("dm,dam->am", T_rate, along_y)).sum(axis=0) * 4.0 * radius / largest**2
            gradient[:, 0, 2] = by_radius * self.disc.growth(height)
            return gradient

        return Look(c_k, pull)


def disc_factor(z: Array, rim: float = 1.0) -> Array:
    """A disc's coefficient over its centre's, at z = κ r: ∫ w(s) J₀(z s) s ds / ∫ w(s) s ds, 2 J₁(z)/z if uniform.

    Bessel functions by their integrals, at nodes that converge faster than any power once there are more than z.
    """
    nodes = EXTRA_NODES + math.ceil(float(z.max(initial=0.0)))
    angle = np.pi * np.arange(1, nodes + 1) / (nodes + 1)
    if rim == 1.0:  # strips: 2 J₁(z)/z = (2/π) ∫ √(1 − s²) cos(z s) ds
        uniform: Array = np.cos(z[..., None] * np.cos(angle)) @ np.sin(angle) ** 2 * (2.0 / (nodes + 1))
        return uniform
    s, weight = gauss(RINGS)
    density = weight * s * rim ** (s**2)
    quarter = 0.5 * np.pi * (np.arange(nodes) + 0.5) / nodes
    j0 = np.cos(z[..., None, None] * s[:, None] * np.sin(quarter)).mean(axis=-1)
    weighted: Array = j0 @ density / density.sum()
    return weighted


def _halvings(basis: CosineBasis, radius: float) -> int:
    """How often the largest radius that fits can be halved and still be no less than ``radius``."""
    largest = 0.5 * float((basis.upper - basis.lower).min())
    return max(0, math.floor(math.log2(largest / radius)))


@lru_cache(maxsize=32)
def _factors(n: int, side_x: float, side_y: float, rim: float, halvings: int) -> tuple[Array, float]:
    """Chebyshev coefficients (D, n, n) of the factors in (r/largest)², and that largest radius [m]."""
    largest = 0.5 * min(side_x, side_y) / 2.0**halvings
    k = np.arange(n) * np.pi
    kappa = np.hypot((k / side_x)[:, None], (k / side_y)[None])
    degree = 20 + math.ceil(float(kappa.max()) * largest)  # the factor is entire: more than enough
    node = np.cos(np.pi * (np.arange(degree) + 0.5) / degree)
    values = disc_factor(kappa * (largest * np.sqrt(0.5 * (node + 1.0)))[:, None, None], rim)
    T, _ = _chebyshev(node, degree)
    A = np.einsum("dj,jab->dab", T, values) * (2.0 / degree)
    A[0] *= 0.5
    counts = np.abs(A).max(axis=(1, 2)) > NEGLIGIBLE
    return frozen(A[: int(np.flatnonzero(counts)[-1]) + 1]), largest


def _chebyshev(y: Array, degree: int) -> tuple[Array, Array]:
    """T_d(y) and their derivatives, (D, M) each, at y (M,) in [−1, 1]."""
    d, theta = np.arange(degree)[:, None], np.arccos(np.clip(y, -1.0, 1.0))
    sine = np.maximum(np.sin(theta), FLAT)
    return np.cos(d * theta), d * np.sin(d * theta) / sine
