"""One axis or several through given knots: least squares, with a derivative bounded in continuous time.

    minimise    ∫ (p − q)² + μ² (p̈ − q̈)² dt
    subject to  |p⁽ᵏ⁾| <= cap  (control points of the derivative, every piece cut in four)
                p = q, ṗ = q̇ and p̈ = p⃛ = 0 at both ends (or what is given at the first)

over C³ splines of degree 7. q is known in continuous time, so the error is time-synchronised and holds between samples.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from missions.arrays import Array, frozen
from planner.trajectory.bounded import LocalQuadratic
from planner.trajectory.spline import MU, SepticSpline, bernstein, derivative_points, local

_NODES = 32  # Gauss points a piece; pieces are shorter than a few seconds, planning steps about 0.1 s
_CUTS = 2
_HEADROOM = 2e-4  # of the cap, for rounding and for the solver's own tolerance
_TOLERANCE = 1e-4  # of the cap


class Motion(Protocol):
    """What is followed: values (K, axes) of a derivative at times (K,) [s]."""

    def __call__(self, t: Array, derivative: int = 0) -> Array:
        """Evaluate."""


@dataclass(frozen=True)
class Bound:
    """|derivative of this order| <= cap, per axis; one cap for all pieces or one for each (M,)."""

    order: int
    cap: float | Array


@dataclass(frozen=True)
class Fit:
    """A spline and how good it is.

    Attributes:
        spline: its knots and maps. unknowns: (axes, M+1, 4).
        errors: (M,) largest distance from the motion on every piece, at its Gauss points.
        excess: how far the bounded derivative's control points are beyond the cap; 0 if they are not.
    """

    spline: SepticSpline
    unknowns: Array
    errors: Array
    excess: float

    @property
    def pieces(self) -> int:
        """M."""
        return len(self.errors)

    @property
    def error(self) -> float:
        """Largest error."""
        return float(self.errors.max())


def fit_motion(
    motion: Motion, knots: Array, bound: Bound, aim: float | None = math.inf, start: Array | None = None
) -> Fit:
    """Fit a motion on given knots.

    Args:
        motion: what is followed, from the first knot to the last.
        knots: (M+1,) [s].
        bound: which derivative is bounded by how much; ``excess`` tells whether that could be met.
        aim: error that is too much to go on for: what comes back then misses the bound a little. None ignores the
            bound.
        start: (axes, 4) position, velocity, acceleration and jerk at the first knot, instead of the motion's own
            position and velocity.
    """
    spline = SepticSpline(knots)
    h = spline.durations
    nodes, weights = _gauss()
    t = (knots[:-1, None] + h[:, None] * nodes).ravel()
    shape = (len(h), _NODES, -1)
    q, a = motion(t).reshape(shape), motion(t, 2).reshape(shape)
    B, B2, G, G2 = _bases()
    C, hm = spline.points, h[:, None, None]
    H = C.swapaxes(1, 2) @ (hm * G + MU**2 * hm**-3 * G2) @ C
    g = C.swapaxes(1, 2) @ (hm * (B.T * weights @ q) + MU**2 / hm * (B2.T * weights @ a))  # (M, 8, axes)
    fixed = np.zeros((q.shape[-1], len(knots), 4))
    ends = [0, -1]
    fixed[:, ends, 0] = motion(knots[ends]).T
    fixed[:, ends, 1] = motion(knots[ends], 1).T * spline.scales[ends]
    if start is not None:
        fixed[:, 0] = start * spline.scales[0] ** np.arange(4)
    rows = derivative_points(bound.order, _CUTS) @ C / hm**bound.order
    quadratic = LocalQuadratic(H, g.transpose(2, 0, 1), fixed)
    caps = np.broadcast_to(np.asarray(bound.cap, dtype=np.float64), len(h))[:, None, None]
    cap = float(caps.max())
    targets = q.transpose(2, 0, 1)

    def errors(x: Array) -> Array:
        error = (B @ C @ local(x)[..., None])[..., 0] - targets
        return np.asarray(np.sqrt(np.square(error).sum(axis=0)).max(axis=1))

    if aim is None:
        x = quadratic.minimum()
    else:
        scaled = rows * (cap / caps)
        x = quadratic.bounded(scaled, cap * (1 - _HEADROOM), cap * _TOLERANCE, lambda x: float(errors(x).max()) <= aim)
    excess = float((np.abs(rows @ local(x)[..., None])[..., 0] - caps[..., 0]).max())
    return Fit(spline, x, errors(x), max(0.0, excess))


@functools.cache
def _gauss() -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    return frozen(0.5 * (nodes + 1.0)), frozen(0.5 * weights)


@functools.cache
def _bases() -> tuple[Array, Array, Array, Array]:
    """Bernstein polynomials and their second derivatives at the nodes (Q, 8), and both Gram matrices (8, 8)."""
    nodes, weights = _gauss()
    B = bernstein(nodes, 7)
    B2 = bernstein(nodes, 5) @ derivative_points(2)
    return frozen(B), frozen(B2), frozen(B.T * weights @ B), frozen(B2.T * weights @ B2)
