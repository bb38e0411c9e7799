"""Spline fits with two-sided bounds in continuous time.

    minimise    ½ xᵀ H x − gᵀ x   for every axis
    subject to  |A x + b| <= cap  (control points of a derivative, piece by piece)

by the method of multipliers: for multipliers λ and penalty ρ the inner problem

    ½ xᵀ H x − gᵀ x + ρ/2 Σ excess(A x + b + λ/ρ)²,   excess(y) = y − clip(y, −cap, cap)

is convex and piecewise quadratic, so Newton's method with a line search ends after a few changes of the set of active
rows; then λ ← ρ excess, and ρ grows. H and AᵀA are block-tridiagonal: a row meets the two knots of its piece only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.trajectory.blocks import solve_blocks
from planner.trajectory.spline import inner, local

_OUTER, _INNER = 12, 25
_GROWTH = 3.0
_SHORTEST_STEP = 1e-6
_PROGRESS, _PATIENCE = 0.7, 2  # rounds that reduce the excess by less than this say that the rows cannot be met
_STIFFNESS = 30.0  # first penalty, in units of H seen through the rows


@dataclass(frozen=True)
class LocalQuadratic:
    """Least squares over the inner knots of a spline; the two outer knots are given.

    Attributes:
        H: (M, 8, 8) what every piece adds, in the unknowns at its two ends.
        g: (axes, M, 8) likewise.
        fixed: (axes, M+1, 4) the unknowns: given at the ends, zero in between.
    """

    H: Array
    g: Array
    fixed: Array

    def minimum(self) -> Array:
        """(axes, M+1, 4) unknowns at the minimum without bounds."""
        x = self.fixed.copy()
        if x.shape[1] > 2:
            right = self.residual(x).transpose(1, 2, 0)[None]  # all axes share one H
            x[:, 1:-1] = solve_blocks(*_blocks(self.H[None]), right)[0].transpose(2, 0, 1)
        return x

    def residual(self, x: Array) -> Array:
        """(axes, M−1, 4) g − H x at the inner knots."""
        return inner(self.g - _times(self.H, local(x)))

    def bounded(
        self, rows: Array, cap: float, tolerance: float, worth: Callable[[Array], bool] = lambda x: True
    ) -> Array:
        """Unknowns (axes, M+1, 4) at the minimum with |rows · x| <= cap.

        Args:
            rows: (M, r, 8) in the unknowns at a piece's ends.
            cap: bound on every row.
            tolerance: largest excess over ``cap`` to accept, in its unit. If the rows cannot be met, the result has
                the least excess the rounds could reach: the caller checks.
            worth: asked after the first round, which finds the shape of the solution and leaves a small excess,
                whether to go on.
        """
        x = self.minimum()
        if x.shape[1] == 2:
            return x
        y = _times(rows, local(x))
        stiffness = float(np.trace(self.H, axis1=1, axis2=2).sum())
        rho = _STIFFNESS * stiffness / max(float(np.square(rows).sum()), 1e-300)
        shift = np.zeros_like(y)  # λ/ρ
        worst, stalled = float(np.abs(y).max()) - cap, 0
        for trial in range(_OUTER):
            if worst <= tolerance or stalled == _PATIENCE or (trial == 1 and not worth(x)):
                break
            x = self._penalised(rows, shift, cap, rho, x)
            y = _times(rows, local(x))
            shift = _excess(y + shift, cap) / _GROWTH
            rho *= _GROWTH
            before, worst = worst, float(np.abs(y).max()) - cap
            stalled = stalled + 1 if worst > _PROGRESS * before else 0
        return x

    def _penalised(self, rows: Array, shift: Array, cap: float, rho: float, x: Array) -> Array:
        """Newton's method, with a line search, on the inner problem, all axes at once."""
        y = _times(rows, local(x)) + shift
        columns = rows.swapaxes(1, 2)
        for _ in range(_INNER):
            excess = _excess(y, cap)
            active = excess != 0.0
            descent = self.residual(x)
            gradient = rho * inner(_times(columns, excess)) - descent
            H = self.H + rho * (columns * active[:, :, None]) @ rows  # (axes, M, 8, 8)
            step = np.zeros_like(x)
            step[:, 1:-1] = -solve_blocks(*_blocks(H), gradient[..., None])[..., 0]
            ends = local(step)
            along, value = _times(rows, ends), rho / 2 * float(np.vdot(excess, excess))
            slope = float(np.vdot(gradient, step[:, 1:-1]))
            linear, curvature = -float(np.vdot(descent, step[:, 1:-1])), float(np.vdot(ends, _times(self.H, ends)))
            length = 1.0
            while length > _SHORTEST_STEP:
                trial = _excess(y + length * along, cap)
                change = length * linear + length**2 / 2 * curvature + rho / 2 * float(np.vdot(trial, trial)) - value
                if change <= 1e-4 * length * slope:
                    break
                length /= 2
            x, y = x + length * step, y + length * along
            if length == 1.0 and np.array_equal(trial != 0.0, active):
                break  # the minimum of this quadratic is the minimum
        return x


def _blocks(H: Array) -> tuple[Array, Array]:
    """Diagonal and upper blocks at the inner knots, from (S, M, 8, 8)."""
    return H[:, :-1, 4:, 4:] + H[:, 1:, :4, :4], H[:, 1:-1, :4, 4:]


def _times(maps: Array, vectors: Array) -> Array:
    """(axes, M, r) from (M, r, 8) and (axes, M, 8)."""
    return np.asarray((maps @ vectors[..., None])[..., 0])


def _excess(y: Array, cap: float) -> Array:
    """How far beyond ±cap, with sign."""
    beyond: Array = y - np.minimum(np.maximum(y, -cap), cap)
    return beyond
