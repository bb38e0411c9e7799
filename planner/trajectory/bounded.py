"""Least squares with two-sided bounds on linear functions.

    minimise ½ xᵀ H x − gᵀ x   subject to   |A x + b| <= cap

by the method of multipliers: for multipliers λ and penalty ρ the inner problem

    ½ xᵀ H x − gᵀ x + ρ/2 Σ excess(A x + b + λ/ρ)²,   excess(y) = y − clip(y, −cap, cap)

is convex and piecewise quadratic, so Newton's method with a line search ends after a few changes of the set of active
rows; then λ ← ρ excess, and ρ grows. Small and dense: a spline has about a hundred unknowns.
"""

from __future__ import annotations

import numpy as np

from missions.arrays import Array

_OUTER, _INNER = 12, 25
_GROWTH = 3.0
_SHORTEST_STEP = 1e-6
_PROGRESS, _PATIENCE = 0.7, 2  # rounds that reduce the excess by less than this say that the rows cannot be met


def bounded_least_squares(H: Array, g: Array, A: Array, b: Array, cap: float, tolerance: float) -> Array:
    """Solve the problem above.

    Args:
        H: (n, n), symmetric positive definite.
        g: (n,).
        A: (m, n).
        b: (m,).
        cap: bound on every row of |A x + b|.
        tolerance: largest excess over ``cap`` to accept, in the unit of ``cap``. If the rows cannot be met, the
            result has the least excess the rounds could reach: the caller checks.

    Returns:
        x (n,).
    """
    x = _solve(H, g)
    y = A @ x + b
    # A penalty that makes the rows about as stiff as the quadratic, seen through the rows.
    rho = 10.0 * float(np.trace(H)) / max(float(np.square(A).sum()), 1e-300)
    shift = np.zeros(len(b))  # λ/ρ
    worst, stalled = float(np.abs(y).max()) - cap, 0
    for _ in range(_OUTER):
        if worst <= tolerance or stalled == _PATIENCE:
            break
        x = _penalised(H, g, A, b + shift, cap, rho, x)
        y = A @ x + b
        shift = _excess(y + shift, cap) / _GROWTH
        rho *= _GROWTH
        before, worst = worst, float(np.abs(y).max()) - cap
        stalled = stalled + 1 if worst > _PROGRESS * before else 0
    return x


def _penalised(H: Array, g: Array, A: Array, b: Array, cap: float, rho: float, x: Array) -> Array:
    """Newton's method, with a line search, on ½ xᵀ H x − gᵀ x + ρ/2 Σ excess(A x + b)²."""
    y = A @ x + b
    for _ in range(_INNER):
        active = np.abs(y) > cap
        rows = A[active]
        excess = _excess(y, cap)
        gradient = H @ x - g + rho * (rows.T @ excess[active])
        step = -_solve(H + rho * rows.T @ rows, gradient)
        slope = float(gradient @ step)
        along, value = A @ step, rho / 2 * float(excess @ excess)
        curvature, linear = float(step @ H @ step), float((H @ x - g) @ step)
        length = 1.0
        while length > _SHORTEST_STEP:
            trial = _excess(y + length * along, cap)
            change = length * linear + length**2 / 2 * curvature + rho / 2 * float(trial @ trial) - value
            if change <= 1e-4 * length * slope:
                break
            length /= 2
        x, y = x + length * step, y + length * along
        if length == 1.0 and np.array_equal(np.abs(y) > cap, active):
            break  # the minimum of this quadratic is the minimum
    return x


def _excess(y: Array, cap: float) -> Array:
    """How far beyond ±cap, with sign."""
    beyond: Array = y - np.clip(y, -cap, cap)
    return beyond


def _solve(H: Array, g: Array) -> Array:
    """H⁻¹ g."""
    return np.asarray(np.linalg.solve(H, g), dtype=np.float64)
