"""Largest values of ratios of polynomials with proof: branch and bound on their Bernstein coefficients.

With coefficients n_i of the numerator and d_i > 0 of the denominator in the same degree, the ratio is a weighted mean
of n_i / d_i, hence nowhere above the largest of them; its values at both ends of the interval are taken. Halving closes
the gap quadratically, as for polynomials.
"""

from __future__ import annotations

import numpy as np

from missions.arrays import Array
from planner.certificate.bernstein import MOST_OPEN, ROUNDS, Measure, halves, identity

ROUNDING = 1e-12  # relative error of coefficients: products of four and sixty rounds of averaging
_SMALLEST = 1e-300  # denominators below it divide to nothing that float64 can hold


def largest_ratio(
    numerator: Array, denominator: Array, start: Array, end: Array, resolution: float, measure: Measure = identity
) -> tuple[float, float, float]:
    """Largest value of numerator / denominator over all intervals.

    Args:
        numerator: (B, n+1) Bernstein coefficients.
        denominator: (B, n+1) of the same degree; the ratio counts as infinite where it is not positive.
        start: (B,) times of the intervals' beginnings [s].
        end: (B,) and ends [s].
        resolution: largest gap between bound and attained, in the measure's unit.
        measure: rising function from ratios to what is reported.

    Returns:
        A bound nothing exceeds, a value that is taken, and when [s].
    """
    best, when, proven = -np.inf, 0.0, -np.inf
    numerator = numerator + ROUNDING * np.abs(numerator).max(axis=1, keepdims=True)
    maps = halves(numerator.shape[1] - 1)
    for _ in range(ROUNDS):
        for side, times in ((0, start), (-1, end)):
            values = _ratio(numerator[:, side], denominator[:, side])
            top = int(np.argmax(values))
            if values[top] > best:
                best, when = float(values[top]), float(times[top])
        high = _ratio(numerator, denominator).max(axis=1)
        open_ = measure(high) > measure(np.array(best)) + resolution
        proven = max(proven, float(high[~open_].max(initial=-np.inf)))
        if not open_.any():
            break
        if best == np.inf or 2 * int(open_.sum()) > MOST_OPEN:  # the bound stays a bound
            proven = max(proven, float(high.max()))
            break
        numerator, denominator, start, end = numerator[open_], denominator[open_], start[open_], end[open_]
        middle = (start + end) / 2
        numerator = np.concatenate([numerator @ half.T for half in maps])
        denominator = np.concatenate([denominator @ half.T for half in maps])
        start, end = np.concatenate([start, middle]), np.concatenate([middle, end])
    else:
        proven = max(proven, float(_ratio(numerator, denominator).max()))
    bound = measure(np.array([max(proven, best), best]))
    return float(bound[0]), float(bound[1]), when


def _ratio(numerator: Array, denominator: Array) -> Array:
    """Elementwise ratio; inf where the denominator is not positive."""
    positive = denominator > _SMALLEST
    with np.errstate(over="ignore"):
        return np.where(positive, numerator / np.where(positive, denominator, 1.0), np.inf)
