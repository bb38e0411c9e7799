"""What robots do within steps: closest approaches in continuous time, not at samples.

Controls are constant over a step, so positions are quadratic in time, and three samples a step say all of it:

    r(s) = r_0 + b s + a s²,   s in [0, 1],   a = 2 (r_0 − 2 r_½ + r_1),   b = 4 r_½ − 3 r_0 − r_1.

The squared distance |r(s)|² is a quartic. Its smallest value over the step is found on a few points and polished by
Newton's method; there, either its slope is zero or s is an end, so by the envelope theorem the gradient of the smallest
value is the gradient at fixed s.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from missions.arrays import Array
from planner.dynamics import Motion

SEARCHED, EXACT = 4, 16  # parts of a step at whose ends a search, and the last word, look for the closest approach
POLISH = 3  # steps of Newton's method, within the neighbouring points
FLAT = 1e-12  # curvature [m²] below which a squared distance counts as flat

Indices = NDArray[np.intp]


class When(Enum):
    """When a constraint counts."""

    ALWAYS = "at every instant"
    CHORDS = "at every instant, as if everybody flew straight from sample to sample"
    SAMPLES = "at the samples of q_fine only, whatever they are"
    END = "at the end only"


@dataclass(frozen=True)
class Paths:
    """All robots in K spans of time: steps, chords between samples, or single samples.

    Attributes:
        x: (ν, N, S) samples [m]; time last, where NumPy is fast.
        count: samples a span: start, middle and end of steps, start and end of chords.
        first: of the first span. stride: from span to span.
    """

    x: Array
    count: int
    first: int = 0
    stride: int = 1

    @classmethod
    def of(cls, motion: Motion, when: When = When.ALWAYS) -> Paths:
        """Paths of a motion, with one sample between any two steps if they are not of samples."""
        x = np.ascontiguousarray(motion.q_fine.T)
        if when is When.ALWAYS:
            return cls(x, 3, stride=2)
        if when is When.CHORDS:
            return cls(x, 2)
        return cls(x, 1, first=0 if when is When.SAMPLES else x.shape[2] - 1)

    @property
    def points(self) -> Array:
        """(count, ν, N, K) samples of the spans [m], a view."""
        return self.windows(self.x)

    @property
    def sample(self) -> Indices:
        """(count, K) rows of q_fine that they are."""
        spans = np.arange(self.first, self.x.shape[2] - self.count + 1, self.stride)
        rows: Indices = spans + np.arange(self.count)[:, None]
        return rows

    def windows(self, x: Array) -> Array:
        """What happens in the spans, (count, ..., K), of what happens at the samples, (..., S): a view."""
        views = sliding_window_view(x, self.count, axis=-1)[..., self.first :: self.stride, :]
        return np.moveaxis(views, -1, 0)

    def scaled(self, scale: Array) -> Paths:
        """With every axis times its ``scale`` (ν,)."""
        return replace(self, x=self.x * scale[:, None, None])

    def boxes(self, block: int) -> tuple[Array, Array]:
        """Corners (ν, N, blocks) of boxes that hold the paths of ``block`` spans each."""
        low, high = hull(self.points)
        if block == 1:
            return low, high
        edges = np.arange(0, low.shape[2], block)
        return np.minimum.reduceat(low, edges, axis=2), np.maximum.reduceat(high, edges, axis=2)

    def at(self, robots: Indices, spans: Indices) -> Array:
        """Points (count, ν, M) of some robots in some spans, M of each."""
        nu, N, S = self.x.shape
        rows = robots * S + (self.first + self.stride * spans) + np.arange(self.count)[:, None]
        chosen: Array = self.x.reshape(nu, N * S).take(rows, axis=1).swapaxes(0, 1)
        return chosen

    def shares(self, s: Array) -> Array:
        """(count, ...) weights of the points in positions at s."""
        if self.count == 2:
            return np.stack([1.0 - s, s])
        return shares(s) if self.count == 3 else np.ones((1, *s.shape))


def hull(points: Array) -> tuple[Array, Array]:
    """Corners (ν, ...) of boxes around the control points of paths through points (count, ν, ...): they hold them."""
    if len(points) < 3:
        return points.min(axis=0), points.max(axis=0)
    start, middle, end = points
    control = start + end
    control *= -0.5
    control += 2.0 * middle
    low, high = np.minimum(start, end), np.maximum(start, end)
    return np.minimum(low, control, out=low), np.maximum(high, control, out=high)


class Closest(NamedTuple):
    """Smallest squared distances to the origin.

    Attributes:
        squares: (...) [m²]. s: (...) when within the span, in [0, 1]; NaN where all that counts is that it is far.
    """

    squares: Array
    s: Array

    def capped(self, reach: Array) -> Closest:
        """No farther than ``reach`` [m]."""
        limit = reach * reach
        near = self.squares < limit
        s = np.full_like(self.s, np.nan)
        np.copyto(s, self.s, where=near)
        return Closest(np.minimum(self.squares, limit), s)


def acting(weights: Array, s: Array) -> tuple[Indices, ...]:
    """Where weights act on closest approaches: nowhere if they are far."""
    found = np.flatnonzero(weights)
    return np.unravel_index(found[np.isfinite(s.ravel()[found])], s.shape)


def closest(points: Array, parts: int = SEARCHED) -> Closest:
    """Closest approach to the origin of quadratic paths through three points (3, ν, ...).

    Never farther than at any end of ``parts`` equal parts of the span; from the nearest of them, the lowest point
    between its neighbours is found by Newton's method. Only a path that is about equally near twice within two parts
    can be nearer than what is found. Of chords (2, ν, ...) the closest approach is known, of single points (1, ν, ...)
    there is nothing to find.
    """
    if len(points) == 1:
        return Closest(_norms(points[0]), np.zeros(points.shape[2:]))
    if len(points) == 2:
        return _closest_of_chords(*points)
    r = points.reshape(3, points.shape[1], -1)
    a, b = 2.0 * (r[0] - 2.0 * r[1] + r[2]), 4.0 * r[1] - 3.0 * r[0] - r[2]
    # ½ d/ds |r|² = c_0 + c_1 s + c_2 s² + c_3 s³
    c = np.stack([_dot(r[0], b), _dot(b, b) + 2.0 * _dot(r[0], a), 3.0 * _dot(a, b), 2.0 * _dot(a, a)])
    change = _looks(parts) @ c  # |r(s)|² − |r(0)|², at every look but the first
    at, lowest = np.zeros(c.shape[1]), np.zeros(c.shape[1])
    for number, row in enumerate(change, start=1):  # argmin over the first axis, at a third of its price
        np.copyto(at, number / parts, where=row < lowest)
        np.minimum(lowest, row, out=lowest)
    guess, low, high = at, np.maximum(at - 1.0 / parts, 0.0), np.minimum(at + 1.0 / parts, 1.0)
    curve = c[1:] * _COUNT
    for _ in range(POLISH):
        slope = c[0] + at * (c[1] + at * (c[2] + at * c[3]))
        curvature = curve[0] + at * (curve[1] + at * curve[2])
        at = np.minimum(np.maximum(at - slope / np.maximum(curvature, FLAT), low), high)
    squares = _squares(r[0], b, a, at)
    lowest += _dot(r[0], r[0])
    at, squares = np.where(squares <= lowest, at, guess), np.minimum(squares, lowest)
    return Closest(squares.reshape(points.shape[2:]), at.reshape(points.shape[2:]))


def _closest_of_chords(start: Array, end: Array) -> Closest:
    """The same for straight paths, where it is known."""
    b = end - start
    slope, curvature = np.einsum("d...,d...->...", start, b), _norms(b)
    at = slope / -np.maximum(curvature, FLAT)
    np.maximum(at, 0.0, out=at)
    np.minimum(at, 1.0, out=at)
    curvature *= at
    slope *= 2.0
    curvature += slope
    curvature *= at
    curvature += _norms(start)
    return Closest(curvature, at)


_COUNT = np.array([[1.0], [2.0], [3.0]])


@functools.cache
def _looks(parts: int) -> Array:
    """∫ 2 s^n (parts, 4), n = 0..3, up to the ends s of equal parts of a span."""
    s = np.arange(1, parts + 1) / parts
    return np.stack([2.0 * s, s**2, s**3 * (2.0 / 3.0), 0.5 * s**4], axis=1)


def _dot(a: Array, b: Array) -> Array:
    """(M,) of (ν, M)."""
    product: Array = np.einsum("dm,dm->m", a, b)
    return product


def _norms(x: Array) -> Array:
    """Squared lengths (...) of (ν, ...)."""
    squares: Array = np.einsum("d...,d...->...", x, x)
    return squares


def _squares(start: Array, b: Array, a: Array, s: Array) -> Array:
    """|r(s)|² (M,)."""
    position = start + s * (b + s * a)
    return _dot(position, position)


def near_origin(points: Array, reach: Array) -> NDArray[np.bool_]:
    """Whether paths (3, ν, ...) may come closer to the origin than ``reach``, by the boxes around them."""
    low, high = hull(points)
    gap = np.maximum(np.maximum(low, -high), 0.0)
    return np.asarray(np.einsum("d...,d...->...", gap, gap) < reach**2)


def shares(s: Array) -> Array:
    """(3, ...) weights of start, middle and end in the position at s."""
    return np.stack([(2.0 * s - 1.0) * (s - 1.0), 4.0 * s * (1.0 - s), s * (2.0 * s - 1.0)])


def place_at(points: Array, share: Array) -> Array:
    """Positions (ν, ...) from the points (3 or 1, ν, ...) of paths and their shares (3 or 1, ...)."""
    place: Array = points[0] * share[0]
    for point, weight in zip(points[1:], share[1:], strict=True):
        place += point * weight
    return place


def push(gradient: Array, samples: Indices, weights: Array, robots: Indices, force: Array) -> None:
    """Add forces on robots at instants within spans to the gradient by the samples.

    Args:
        gradient: (S, N, ν), changed in place; may be a view of some of the axes.
        samples: (3, M) rows of start, middle and end, or (1, M) of samples.
        weights: (3, M) or (1, M) of each.
        robots: (M,) whom.
        force: (ν, M).
    """
    S, N, _ = gradient.shape
    at = (samples * N + robots).ravel()
    for d, component in enumerate(force):
        total = np.bincount(at, (weights * component).ravel(), S * N)
        gradient[..., d] += total.reshape(S, N)
