"""Limited-memory BFGS with a strong-Wolfe line search (Nocedal and Wright, algorithms 7.4, 7.5, 3.5 and 3.6)."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from missions.arrays import Array

Objective = Callable[[Array], tuple[float, Array]]

ARMIJO = 1e-4
CURVATURE = 0.9
LINE_SEARCH_EVALUATIONS = 20


@dataclass
class Memory:
    """The last few steps s and gradient differences y: what is known of the Hessian."""

    size: int = 20
    pairs: deque[tuple[Array, Array, float]] = field(default_factory=deque)

    def add(self, s: Array, y: Array) -> None:
        """Remember a step, if it shows positive curvature."""
        sy = float(s @ y)
        if sy > 1e-12 * float(y @ y):
            self.pairs.append((s, y, 1.0 / sy))
            if len(self.pairs) > self.size:
                self.pairs.popleft()

    def direction(self, gradient: Array) -> Array:
        """−H g by the two-loop recursion."""
        q = gradient.copy()
        alphas = []
        for s, y, rho in reversed(self.pairs):
            alpha = rho * float(s @ q)
            q -= alpha * y
            alphas.append(alpha)
        if self.pairs:
            _, y, rho = self.pairs[-1]
            q /= rho * float(y @ y)
        for (s, y, rho), alpha in zip(self.pairs, reversed(alphas), strict=True):
            q += (alpha - rho * float(y @ q)) * s
        return -q


@dataclass(frozen=True)
class Point:
    """A point, the objective and its gradient there."""

    z: Array
    f: float
    g: Array


def minimise(
    objective: Objective,
    start: Point,
    memory: Memory,
    *,
    max_iterations: int,
    gradient_tolerance: float,
    keep_going: Callable[[], bool],
) -> Point:
    """Descend from ``start``; ``memory`` is read and extended, so that a slightly changed objective starts informed.

    Ends after ``max_iterations``, when |g| ≤ ``gradient_tolerance``, when no step descends any more, or when
    ``keep_going()`` says no.
    """
    point = start
    for _ in range(max_iterations):
        if float(np.linalg.norm(point.g)) <= gradient_tolerance or not keep_going():
            break
        direction = memory.direction(point.g)
        if float(direction @ point.g) >= 0.0:
            memory.pairs.clear()
            direction = -point.g
        step = 1.0 if memory.pairs else min(1.0, 1.0 / float(np.linalg.norm(point.g)))
        found = line_search(objective, point, direction, step)
        if found is None:
            if not memory.pairs:
                break
            memory.pairs.clear()  # the old Hessian misleads; steepest descent decides whether this is the end
            continue
        memory.add(found.z - point.z, found.g - point.g)
        point = found
    return point


def line_search(objective: Objective, start: Point, direction: Array, step: float) -> Point | None:
    """A point along ``direction`` that meets the strong Wolfe conditions; the best Armijo point if none was found.

    Returns:
        None if not even the Armijo condition could be met.
    """
    slope = float(start.g @ direction)
    low, f_low, slope_low = 0.0, start.f, slope
    high: tuple[float, float, float] | None = None  # bracket's other end: step, f, slope
    best: Point | None = None
    for _ in range(LINE_SEARCH_EVALUATIONS):
        z = start.z + step * direction
        f, g = objective(z)
        slope_here = float(g @ direction)
        if not math.isfinite(f) or f > start.f + ARMIJO * step * slope or (f >= f_low and low > 0.0):
            high = (step, f, slope_here)
        else:
            best = Point(z, f, g)
            if abs(slope_here) <= -CURVATURE * slope:
                return best
            if slope_here * ((high[0] if high else math.inf) - low) >= 0.0:
                high = (low, f_low, slope_low)
            low, f_low, slope_low = step, f, slope_here
        step = 2.0 * low if high is None else _interpolate((low, f_low, slope_low), high)
        if high is not None and abs(high[0] - low) < 1e-12 * max(1.0, low):
            break
    return best


def _interpolate(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    """Minimiser of the cubic through two (step, value, slope), kept away from the ends of the bracket."""
    (xa, fa, da), (xb, fb, db) = a, b
    width = xb - xa
    middle = 0.5 * (xa + xb)
    if not math.isfinite(fb):
        return xa + 0.1 * width
    d1 = da + db - 3.0 * (fa - fb) / (xa - xb)
    square = d1 * d1 - da * db
    if square < 0.0:
        return middle
    d2 = math.copysign(math.sqrt(square), width)
    denominator = db - da + 2.0 * d2
    x = xb - width * (db + d2 - d1) / denominator if denominator else middle
    inner, outer = sorted((xa + 0.1 * width, xb - 0.1 * width))
    return min(max(x, inner), outer)
