"""Uniform discs that reach over the workspace's edge: one integral in closed form, the other at Gauss's nodes.

Strips across a disc, at u = c + r sin θ, are chords of half length r cos θ that end at the workspace's edge at the
latest; a cosine's integral over a chord is a difference of sines. Strips lie along the edge that is nearest, which
bounds θ, so only corners cut some of them short. What is seen counts for one whole look, however much of the disc is
left of it (FEO, Definition 1). Gradients are those of the quadrature itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.ergodic.basis import CosineBasis
from planner.footprint.base import Look, gauss, step_by_step
from planner.footprint.outline import Disc

STRIPS = 16  # exact to 1e-3 where a corner cuts strips short, to rounding where only one edge does
STEEPEST = 1e-6  # least cos θ at the edge: a disc that just touches it


@dataclass(frozen=True)
class ClippedDisc:
    """A uniform disc of which only the part inside the workspace is seen.

    Attributes:
        disc: its size. strips: J.
    """

    disc: Disc
    strips: int = STRIPS

    def look(self, basis: CosineBasis, x: Array) -> Look:
        """See :class:`~planner.footprint.base.Footprint`."""
        flat = x.reshape(-1, 3)
        centre, radius = np.clip(flat[:, :2], basis.lower, basis.upper), self.disc.size(flat[:, 2])
        room = np.minimum(centre - basis.lower, basis.upper - centre)
        first = room[:, 0] <= room[:, 1]
        groups = [
            (chosen, _Strips(basis, axis, centre[chosen], radius[chosen], self.strips))
            for axis, chosen in ((0, first), (1, ~first))
            if chosen.any()
        ]
        c_k: Array = sum((part.sums for _, part in groups), np.zeros((basis.n,) * 2)) / (len(flat) * basis.h_k)

        def pull(weights: Array) -> Array:
            G, gradient = weights / (len(flat) * basis.h_k), np.empty(flat.shape)
            for chosen, part in groups:
                gradient[chosen] = part.pull(G)
            gradient[:, :2] *= centre == flat[:, :2]  # from beyond the edge, the nearest point is looked at
            gradient[:, 2] *= self.disc.growth(flat[:, 2])
            return gradient.reshape(x.shape)

        return Look(c_k, pull)

    def each(self, basis: CosineBasis, x: Array) -> Array:
        """See :class:`~planner.footprint.base.Footprint`."""
        return step_by_step(self, basis, x)


class _Strips:
    """Strips of M discs: axis ``a`` across them, ``b`` along them.

    Attributes:
        sums: (n, n) of the footprints' cosine integrals over their areas.
    """

    def __init__(self, basis: CosineBasis, axis: int, centre: Array, radius: Array, strips: int) -> None:
        self.axis, self.r = axis, radius[:, None]
        self.share, self.weight = gauss(strips)  # (J,)
        lower, upper = basis.lower[[axis, 1 - axis]], basis.upper[[axis, 1 - axis]]
        self.sides = upper - lower  # across, along
        c_a, c_b = centre[:, [axis]], centre[:, [1 - axis]]
        self.sine = np.clip(np.array([lower[0] - c_a, upper[0] - c_a]) / self.r, -1.0, 1.0)
        theta = np.arcsin(self.sine)  # (2, M, 1): where the disc begins and ends
        self.span = theta[1] - theta[0]
        self.theta = theta[0] + self.span * self.share  # (M, J)
        self.h = self.r * np.cos(self.theta)
        asked = c_b + np.array([-1.0, 1.0])[:, None, None] * self.h
        ends = np.minimum(np.maximum(asked, lower[1]), upper[1])  # (2, M, J)
        self.free = (ends == asked).astype(np.float64)  # 1 where it is the disc's outline, 0 where the workspace's
        u = (c_a + self.r * np.sin(self.theta) - lower[0]) / self.sides[0]
        self.cosine, self.sines = _tables(basis.n, np.stack((u, *((ends - lower[1]) / self.sides[1]))))
        extent = ends[1] - ends[0]
        frequency = np.arange(1, basis.n)[:, None] * np.pi / self.sides[1]
        self.V = np.empty((basis.n, u.size))  # [m] integrals of the cosines along strips
        self.V[0] = extent.ravel()
        self.V[1:] = (self.sines[1:, 2] - self.sines[1:, 1]) / frequency
        self.omega = self.h * self.span * self.weight
        self.area = (self.omega * extent).sum(axis=1, keepdims=True)
        self.parts = self.omega / self.area  # (M, J) [1/m]
        sums = (self.cosine[:, 0] * self.parts.ravel()) @ self.V.T
        self.sums: Array = sums if axis == 0 else sums.T

    def pull(self, G: Array) -> Array:
        """Gradient (M, 3) of Σ G · sums by centre and radius."""
        G = G if self.axis == 0 else G.T
        k = np.arange(len(G), dtype=np.float64)[:, None]
        shape = self.h.shape
        on_strip = G.T @ self.cosine[:, 0]  # (n, M·J) series along a strip
        F = np.einsum("bm,bm->m", on_strip, self.V).reshape(shape)
        mean = (self.parts * F).sum(axis=1, keepdims=True)
        by_u = (
            self.parts
            * (-np.pi / self.sides[0])
            * np.einsum("am,am->m", self.sines[:, 0], k * G @ self.V).reshape(shape)
        )
        at_ends = np.einsum("bm,bem->em", on_strip, self.cosine[:, 1:]).reshape(2, *shape)
        by_left, by_right = np.array([-1.0, 1.0])[:, None, None] * self.parts * self.free * (at_ends - mean)
        by_omega = (F - mean * self.V[0].reshape(shape)) / self.area
        by_h = self.span * self.weight * by_omega + by_right - by_left
        by_span = (self.h * self.weight * by_omega).sum(axis=1)
        by_theta = by_u * self.h - by_h * self.r * np.sin(self.theta)
        by_bounds = (by_theta @ (1.0 - self.share) - by_span, by_theta @ self.share + by_span)
        gradient = np.empty((len(self.h), 3))
        gradient[:, self.axis] = by_u.sum(axis=1)
        gradient[:, 1 - self.axis] = (by_left + by_right).sum(axis=1)
        gradient[:, 2] = (by_u * np.sin(self.theta) + by_h * np.cos(self.theta)).sum(axis=1)
        for sine, by_end in zip(self.sine[..., 0], by_bounds, strict=True):
            cut = np.abs(sine) < 1.0  # else the disc ends before the workspace does
            rate = cut * by_end / (self.r[:, 0] * np.maximum(np.sqrt(1.0 - sine**2), STEEPEST))
            gradient[:, self.axis] -= rate
            gradient[:, 2] -= rate * sine
        return gradient


def _tables(n: int, w: Array) -> tuple[Array, Array]:
    """Cosines and sines (n, 3, M·J) of kπw, w (3, M, J) in [0, 1]."""
    cosine, sine = CosineBasis(np.zeros(1), np.ones(1), n).tables(w.reshape(-1, 1))
    return cosine.reshape(n, len(w), -1), sine.reshape(n, len(w), -1)
