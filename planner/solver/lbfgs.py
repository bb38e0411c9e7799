"""Limited-memory BFGS with a strong-Wolfe line search (Nocedal and Wright, algorithms 7.4, 7.5, 3.5 and 3.6).

Written as generators that ask for the objective instead of calling it: many descents can then share evaluations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from missions.arrays import Array

T = TypeVar("T")
Objective = Callable[[Array], tuple[float, Array]]
Asking = Generator[Array, tuple[float, Array], T]  # yields z, is sent the objective and its gradient there

ARMIJO = 1e-4
CURVATURE = 0.9
LINE_SEARCH_EVALUATIONS = 20


class Memory:
    """The last few steps s and gradient differences y: what is known of the Hessian.

    Kept as rows of two matrices with their products, so that a direction is a handful of matrix-vector products
    (Byrd, Nocedal and Schnabel 1994, Eq. 3.1) instead of a loop over all of them.
    """

    def __init__(self, size: int = 20) -> None:
        self.size = size
        self.clear()

    def __len__(self) -> int:
        return self.end - self.first

    def clear(self) -> None:
        """Forget everything."""
        self.first = self.end = 0  # rows in use of the two buffers, which have room for as many again
        self.s_rows: Array = np.empty((0, 0))
        self.y_rows: Array = np.empty((0, 0))
        self.SY: Array = np.empty((0, 0))
        self.YY: Array = np.empty((0, 0))
        self.R_inverse: Array = np.empty((0, 0))  # of the upper triangle R of SY

    @property
    def S(self) -> Array:
        """(m, n) steps, oldest first."""
        return self.s_rows[self.first : self.end]

    @property
    def Y(self) -> Array:
        """(m, n) gradient differences."""
        return self.y_rows[self.first : self.end]

    def add(self, s: Array, y: Array) -> None:
        """Remember a step, if it shows positive curvature."""
        if float(s @ y) <= 1e-12 * float(y @ y):
            return
        drop = len(self) - self.size + 1
        self._append(s, y, max(drop, 0))
        Sy = self.S @ y
        self.SY = _bordered(self.SY, Sy, self.Y @ s, drop)
        self.R_inverse = _inverse_bordered(self.R_inverse, Sy, drop)
        self.YY = _bordered(self.YY, self.Y @ y, self.Y @ y, drop)

    def _append(self, s: Array, y: Array, drop: int) -> None:
        """A row more, and ``drop`` of the oldest fewer; rows move only when a buffer is full."""
        if len(self) == 0:
            self.s_rows, self.y_rows = np.empty((2 * self.size, len(s))), np.empty((2 * self.size, len(s)))
        self.first += drop
        if self.end == len(self.s_rows):
            count = len(self)
            for rows in (self.s_rows, self.y_rows):
                rows[:count] = rows[self.first : self.end].copy()
            self.first, self.end = 0, count
        self.s_rows[self.end], self.y_rows[self.end] = s, y
        self.end += 1

    def direction(self, gradient: Array, inverse: Callable[[Array], Array] | None = None) -> Array:
        """−H g with H₀ = ``inverse``, or γ I with γ = s·y/y·y of the latest step."""
        if inverse is not None:
            return self._around(gradient, inverse)
        if len(self) == 0:
            return -gradient
        gamma = self.SY[-1, -1] / self.YY[-1, -1]
        R_inverse = self.R_inverse
        a = R_inverse @ (self.S @ gradient)
        b = (np.diag(self.SY) * a) + gamma * (self.YY @ a - self.Y @ gradient)
        step: Array = gamma * (a @ self.Y - gradient) - (b @ R_inverse) @ self.S
        return step

    def _around(self, gradient: Array, inverse: Callable[[Array], Array]) -> Array:
        """The same around any H₀, by two loops (Nocedal and Wright, algorithm 7.4)."""
        step, curvature = -gradient, np.diag(self.SY)
        shares = np.zeros(len(self))
        for k in reversed(range(len(self))):
            shares[k] = float(self.S[k] @ step) / curvature[k]
            step -= shares[k] * self.Y[k]
        step = inverse(step)
        for s, y, share, sy in zip(self.S, self.Y, shares, curvature, strict=True):
            step += (share - float(y @ step) / sy) * s
        return step


def _bordered(square: Array, column: Array, row: Array, drop: int) -> Array:
    """A matrix of products after a step came (its last row and column) and ``drop`` old ones went."""
    keep = slice(max(drop, 0), None)
    out = np.empty((len(column), len(column)))
    out[:-1, :-1] = square[keep, keep]
    out[:, -1], out[-1, :] = column, row
    return out


def _inverse_bordered(inverse: Array, column: Array, drop: int) -> Array:
    """The inverse of an upper triangular matrix that got a last column, and lost ``drop`` first rows and columns.

    What is left of a triangular matrix is the inverse of what is left of its inverse.
    """
    kept = inverse[max(drop, 0) :, max(drop, 0) :]
    out = np.zeros((len(column), len(column)))
    out[:-1, :-1] = kept
    out[-1, -1] = 1.0 / column[-1]
    out[:-1, -1] = kept @ column[:-1] * -out[-1, -1]
    return out


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
    inverse: Callable[[Array], Array] | None = None,
) -> Point:
    """Descend from ``start``: :func:`descend` with every question answered by ``objective``."""
    descent = descend(
        start,
        memory,
        max_iterations=max_iterations,
        gradient_tolerance=gradient_tolerance,
        keep_going=keep_going,
        inverse=inverse,
    )
    return answered(descent, objective)


def answered(asking: Asking[T], objective: Objective) -> T:
    """What a generator comes to when ``objective`` answers all it asks."""
    try:
        z = next(asking)
        while True:
            z = asking.send(objective(z))
    except StopIteration as end:
        result: T = end.value
        return result


def descend(
    start: Point,
    memory: Memory,
    *,
    max_iterations: int,
    gradient_tolerance: float,
    keep_going: Callable[[], bool],
    inverse: Callable[[Array], Array] | None = None,
) -> Asking[Point]:
    """Descend from ``start``; ``memory`` is read and extended, so that a slightly changed objective starts informed.

    ``inverse`` applies what is known of the Hessian's inverse otherwise, if anything is.
    Ends after ``max_iterations``, when |g| ≤ ``gradient_tolerance``, when no step descends any more, or when
    ``keep_going()`` says no.
    """
    point = start
    for _ in range(max_iterations):
        if float(np.linalg.norm(point.g)) <= gradient_tolerance or not keep_going():
            break
        direction = memory.direction(point.g, inverse)
        if float(direction @ point.g) >= 0.0:
            memory.clear()
            direction = memory.direction(point.g, inverse)
        step = 1.0 if len(memory) or inverse is not None else min(1.0, 1.0 / float(np.linalg.norm(point.g)))
        found = yield from line_search(point, direction, step)
        if found is None:
            if len(memory) == 0:
                break
            memory.clear()  # the old Hessian misleads; steepest descent decides whether this is the end
            continue
        memory.add(found.z - point.z, found.g - point.g)
        point = found
    return point


def line_search(start: Point, direction: Array, step: float) -> Asking[Point | None]:
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
        f, g = yield z
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
