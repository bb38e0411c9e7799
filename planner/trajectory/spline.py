"""Degree-7 splines that are C³ by construction: septic Hermite pieces.

The unknowns are position, velocity, acceleration and jerk at the knots. The 8 control points of a piece of length h
are linear in the 8 numbers at its two ends, so whatever the unknowns are, pieces agree up to jerk at every joint; and
what is fixed (start, end, rest) is simply no unknown. An unknown reaches two pieces only, so everything here is local:
a piece's 8 numbers, its 8 control points.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array, frozen
from planner.trajectory.bezier import power_coefficients

STATE = 4  # position, velocity, acceleration, jerk
MU = 0.05  # [s²] weight of acceleration errors against position errors: faster changes than ~√μ are smoothed


@dataclass(frozen=True)
class SepticSpline:
    """The linear maps of a C³ spline of degree 7 on given knots.

    Unknowns are (axes, M+1, 4): p, v σ, a σ², j σ³ at every knot; σ, the mean length of the pieces beside it, makes
    all of them lengths of about the same size.

    Attributes:
        knots: (M+1,) [s].
    """

    knots: Array

    @functools.cached_property
    def durations(self) -> Array:
        """(M,) lengths of the pieces [s]."""
        return np.diff(self.knots)

    @functools.cached_property
    def scales(self) -> Array:
        """(M+1,) σ [s]."""
        h = self.durations
        return np.concatenate([h[:1], 0.5 * (h[1:] + h[:-1]), h[-1:]])

    @functools.cached_property
    def points(self) -> Array:
        """(M, 8, 8) maps from the unknowns at the two ends of a piece to its control points."""
        j = np.arange(STATE)
        left = (self.durations / self.scales[:-1])[:, None] ** j
        right = (self.durations / self.scales[1:])[:, None] ** j
        maps: Array = hermite_points() * np.concatenate([left, right], axis=1)[:, None, :]
        return maps

    def coefficients(self, unknowns: Array) -> Array:
        """(M, axes, 8) ascending powers of the pieces, from (axes, M+1, 4) unknowns."""
        points = (self.points @ local(unknowns)[..., None])[..., 0]  # (axes, M, 8)
        return power_coefficients(points.swapaxes(0, 1), self.durations)


def local(x: Array) -> Array:
    """(axes, M, 8) the unknowns at the two ends of every piece, from (axes, M+1, 4)."""
    return np.concatenate([x[:, :-1], x[:, 1:]], axis=-1)


def inner(gradient: Array) -> Array:
    """(axes, M−1, 4) sums over the two pieces at every inner knot: the transpose of :func:`local`."""
    total: Array = gradient[:, :-1, 4:] + gradient[:, 1:, :4]
    return total


@functools.cache
def hermite_points() -> Array:
    """(8, 8) from p, v h, a h², j h³ at both ends of a piece of length h to its control points.

    Derivative k contributes C(i,k) / C(7,k) / k! to control point i of its own half.
    """
    maps = np.zeros((8, 8))
    for k in range(STATE):
        for i in range(k, STATE):
            weight = math.comb(i, k) / math.comb(7, k) / math.factorial(k)
            maps[i, k] = weight
            maps[7 - i, STATE + k] = (-1) ** k * weight
    return frozen(maps)


@functools.cache
def derivative_points(order: int, cuts: int = 0) -> Array:
    """(2^cuts (8−order), 8) from control points to those of h^order times a derivative, on 2^cuts equal parts.

    The control points of the parts bound the derivative, the closer the more parts.
    """
    maps = np.eye(8)
    for degree in range(7, 7 - order, -1):
        maps = degree * np.diff(maps, axis=0)
    n = 7 - order
    left = np.array([[math.comb(i, j) / 2.0**i for j in range(n + 1)] for i in range(n + 1)])  # de Casteljau
    right = left[::-1, ::-1]
    parts = [maps]
    for _ in range(cuts):
        parts = [half @ part for part in parts for half in (left, right)]
    return frozen(np.concatenate(parts))


def bernstein(u: Array, degree: int) -> Array:
    """(len(u), degree+1) Bernstein polynomials at u in [0, 1]."""
    i = np.arange(degree + 1)
    binomials = np.array([math.comb(degree, k) for k in i], dtype=np.float64)
    basis: Array = binomials * u[:, None] ** i * (1.0 - u[:, None]) ** (degree - i)
    return basis
