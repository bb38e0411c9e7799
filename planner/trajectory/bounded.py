"""Least squares with two-sided bounds on linear functions.

    minimise ½ xᵀ H x − gᵀ x   subject to   |A x + b| <= cap

by the method of multipliers: for multipliers λ and penalty ρ the inner problem

    ½ xᵀ H x − gᵀ x + ρ/2 Σ excess(A x + b + λ/ρ)²,   excess(y) = y − clip(y, −cap, cap)

is piecewise quadratic, and Newton's method on it ends after a few changes of the set of active rows; then
λ ← ρ excess, ρ grows. Small and dense: a spline has about a hundred unknowns.
"""

from __future__ import annotations

import numpy as np

from missions.arrays import Array

_OUTER, _INNER = 12, 12
_GROWTH = 3.0


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
    for _ in range(_OUTER):
        if np.abs(y).max() <= cap + tolerance:
            break
        active = np.zeros(len(b), dtype=bool)
        for _ in range(_INNER):
            now = np.abs(y + shift) > cap
            if np.array_equal(now, active):
                break
            active = now
            rows = A[now]
            target = np.copysign(cap, (y + shift)[now]) - b[now] - shift[now]
            x = _solve(H + rho * rows.T @ rows, g + rho * rows.T @ target)
            y = A @ x + b
        shift += y
        shift -= np.clip(shift, -cap, cap)
        shift /= _GROWTH
        rho *= _GROWTH
    return x


def _solve(H: Array, g: Array) -> Array:
    """H⁻¹ g."""
    return np.asarray(np.linalg.solve(H, g), dtype=np.float64)
