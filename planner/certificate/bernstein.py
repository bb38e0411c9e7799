"""Extrema of polynomials with proof: branch and bound on Bernstein coefficients.

A polynomial on an interval lies between its smallest and largest Bernstein coefficient, and the first and last
coefficient are values it takes. Halving the interval (de Casteljau) closes the gap quadratically, so a few rounds
over all polynomials at once, dropping those that cannot hold the minimum, find it to any resolution.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array

Index = NDArray[np.intp]
Measure = Callable[[Array], Array]  # rising function from polynomial values to what is reported, e.g. a square root

ROUNDS = 60  # halvings after which float64 times cannot tell ends apart
MOST_OPEN = 200_000  # intervals; only numbers so large that float64 hides the resolution get there
ROUNDING = 1e-14  # relative error of coefficients after 60 rounds of averaging


@dataclass(frozen=True)
class Minimum:
    """Smallest values of groups of polynomials, in the measure's unit.

    Attributes:
        bound: (G,) nothing in the group is smaller than this; inf for an empty group.
        attained: (G,) a value that is taken; bound >= attained - resolution unless the numbers are astronomical.
        time: (G,) when it is taken [s].
    """

    bound: Array
    attained: Array
    time: Array


def identity(values: Array) -> Array:
    """The measure of plain polynomials."""
    return values


def root(values: Array) -> Array:
    """The measure of squared distances: √max(value, 0)."""
    return np.sqrt(np.maximum(values, 0.0))


def negative_root(values: Array) -> Array:
    """The measure of negated squares, for maxima: −√max(−value, 0)."""
    return -np.sqrt(np.maximum(-values, 0.0))


def minimise(
    points: Array, start: Array, end: Array, group: Index, groups: int, resolution: float, measure: Measure = identity
) -> Minimum:
    """Smallest value of every group of polynomials.

    Args:
        points: (B, n+1) Bernstein coefficients.
        start: (B,) times of the intervals' beginnings [s].
        end: (B,) and ends [s].
        group: (B,) group of each polynomial, 0 .. groups-1.
        groups: G.
        resolution: largest gap between bound and attained, in the measure's unit.
        measure: from polynomial values to what is reported.
    """
    best, when, proven = np.full(groups, np.inf), np.zeros(groups), np.full(groups, np.inf)
    maps = halves(points.shape[1] - 1)
    for _ in range(ROUNDS):
        _take(best, when, group, points[:, 0], start)
        _take(best, when, group, points[:, -1], end)
        low = points.min(axis=1) - ROUNDING * np.abs(points).max(axis=1)
        open_ = measure(low) < measure(best[group]) - resolution
        np.minimum.at(proven, group[~open_], low[~open_])
        points, start, end, group, low = points[open_], start[open_], end[open_], group[open_], low[open_]
        if len(points) == 0:
            break
        if len(points) > MOST_OPEN:  # the bound stays a bound, only wider than the resolution
            np.minimum.at(proven, group, low)
            break
        middle = (start + end) / 2
        points = np.concatenate([points @ half.T for half in maps])
        start, end = np.concatenate([start, middle]), np.concatenate([middle, end])
        group, low = np.concatenate([group, group]), np.concatenate([low, low])
    else:
        np.minimum.at(proven, group, low)
    return Minimum(measure(np.minimum(proven, best)), measure(best), when)


def _take(best: Array, when: Array, group: Index, values: Array, times: Array) -> None:
    """Record values that are taken, with the earliest time of the smallest."""
    before = best.copy()
    np.minimum.at(best, group, values)
    hits = (values == best[group]) & (values < before[group])
    when[group[hits][::-1]] = times[hits][::-1]


def product(a: Array, b: Array) -> Array:
    """Bernstein coefficients (..., n+m+1) of the product of (..., n+1) and (..., m+1)."""
    n, m = a.shape[-1] - 1, b.shape[-1] - 1
    out = np.zeros((*np.broadcast_shapes(a.shape[:-1], b.shape[:-1]), n + m + 1))
    _add_convolution(out, a * _binomials(n), b * _binomials(m))
    result: Array = out / _binomials(n + m)
    return result


def square_sum(points: Array) -> Array:
    """Σ_axes p²: Bernstein coefficients (..., 2n+1) of degree 2n from (..., axes, n+1) of degree n."""
    n = points.shape[-1] - 1
    weighted = points * _binomials(n)
    out = np.zeros((*points.shape[:-2], 2 * n + 1))
    for axis in np.moveaxis(weighted, -2, 0):  # sums over an axis of three are slow
        _add_convolution(out, axis, axis)
    result: Array = out / _binomials(2 * n)
    return result


def _add_convolution(out: Array, a: Array, b: Array) -> None:
    """Add Σ_i a_i b_(k-i) to out_k, along the last axis."""
    width = b.shape[-1]
    for i in range(a.shape[-1]):
        out[..., i : i + width] += a[..., i : i + 1] * b


def elevate(points: Array, by: int) -> Array:
    """The same polynomials (..., n+1) in a degree that is higher: (..., n+1+by)."""
    return product(points, np.ones(by + 1))


def derivative(points: Array, durations: Array) -> Array:
    """Bernstein coefficients (M, ..., n) of the time derivative of (M, ..., n+1) on pieces of lengths (M,) [s]."""
    n = points.shape[-1] - 1
    slope: Array = n * np.diff(points, axis=-1) / durations.reshape((-1,) + (1,) * (points.ndim - 1))
    return slope


@functools.cache
def _binomials(n: int) -> Array:
    return np.array([math.comb(n, i) for i in range(n + 1)], dtype=np.float64)


@functools.cache
def halves(n: int) -> tuple[Array, Array]:
    """De Casteljau maps (n+1, n+1) to the coefficients of both halves of the interval."""
    left = np.array([[math.comb(i, j) / 2.0**i for j in range(n + 1)] for i in range(n + 1)])
    return left, left[::-1, ::-1]
