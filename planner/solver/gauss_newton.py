"""What the structure of a problem says about its curvature: the Gauss-Newton matrix of the augmented Lagrangian.

E is a sum of squares and so is the penalty of what is missed, so their gradients alone give most of the Hessian,

    H ≈ 2/((E + ε) ln 10) Σ_k r_k r_kᵀ + R/T SᵀS + μ Σ_active ∇g ∇gᵀ,   r_k = √Λ_k ∂c_k/∂z,

a hundred stiff directions of the logarithm of E and as many of limits that robots fly along. L-BFGS would have to learn
them one by one, and forgets them; from (H + δ I)⁻¹ in place of a multiple of one it needs a tenth of the evaluations
on the published problem. What it still has to learn is what is left of the differences of gradients it has seen,
y − H s, and the typical size of that is the damping δ.

Kept in single precision: it only shapes directions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.constraints.base import Curved, Rows
from planner.dynamics import DoubleIntegrator
from planner.ergodic.metric import SquaresMetric
from planner.solver.lagrangian import SMALLEST_E, Lagrangian, Sample
from planner.solver.lbfgs import Memory

LARGEST = 1200  # variables from which on the matrix costs more than it saves
DAMPED = 0.5  # share of the curvature that is not in H which is taken for granted
MOST_UNKNOWN = 8  # limits in force whose curvature is not in H: what L-BFGS remembers, it forgets in twice as many
LEAST = 1e-5  # damping relative to the largest entry, for single precision
SQUARES = 200  # of E that are taken into account, at most: those of the largest weights

Single = NDArray[np.float32]
Inverse = Callable[[Array], Array]


class GaussNewton:
    """The matrix of one formulation, round after round.

    Variables are ordered robot, axis, mode here, so that a robot's are a block.

    Attributes:
        damping: δ of the latest round; None as long as nothing is known.
    """

    def __init__(self, lagrangian: Lagrangian, dynamics: DoubleIntegrator, damping: float | None) -> None:
        self.lagrangian, self.damping = lagrangian, damping
        _, self.robots, self.nu = dynamics.controls_shape
        S = lagrangian.modes.S
        self.modes = lagrangian.modes.count
        at_origin = replace(dynamics, start=np.zeros((self.modes, 1)), velocity=None, acceleration=None)
        response = at_origin.rollout(S[:, :, None])  # what one unit of each mode does, along any axis
        self.tables = {name: part[..., 0].astype(np.float32) for name, part in response._asdict().items()}

    @classmethod
    def of(cls, lagrangian: Lagrangian, damping: float | None = None) -> GaussNewton | None:
        """The model of a formulation; None if it has no such structure, or is too large for it to pay."""
        dynamics = lagrangian.problem.dynamics
        if not isinstance(dynamics, DoubleIntegrator) or not isinstance(lagrangian.problem.metric, SquaresMetric):
            return None
        _, robots, nu = dynamics.controls_shape
        return cls(lagrangian, dynamics, damping) if lagrangian.modes.count * robots * nu <= LARGEST else None

    def covers(self, multipliers: Sequence[Array]) -> bool:
        """Whether few limits are in force whose curvature it does not know: few enough for L-BFGS to remember."""
        constraints = zip(self.lagrangian.constraints, multipliers, strict=False)  # preferences, last, may have gone
        unknown = sum(int(np.count_nonzero(lam)) for c, lam in constraints if not isinstance(c, Curved))
        return unknown <= MOST_UNKNOWN

    def inverse(self, sample: Sample, multipliers: Sequence[Array], mu: float, memory: Memory) -> Inverse | None:
        """(H + δ I)⁻¹ at a sample, to be applied to a gradient (flat); None before anything is known of δ."""
        H = self.matrix(sample, multipliers, mu)
        if len(memory):
            s, y = self._blocked(memory.S), self._blocked(memory.Y)
            unknown = np.linalg.norm(y - s @ H, axis=1) / np.linalg.norm(s, axis=1)
            self.damping = DAMPED * float(np.median(unknown))
        if self.damping is None or not math.isfinite(self.damping):
            return None
        H.ravel()[:: len(H) + 1] += max(self.damping, LEAST * float(H.max()))
        try:
            factor = Factor.of(H, self.modes)
        except np.linalg.LinAlgError:
            return None

        def solved(gradient: Array) -> Array:
            x = factor.solve(self._blocked(gradient[None])[0])
            return np.ascontiguousarray(x.reshape(-1, self.modes).T, dtype=np.float64).ravel()

        return solved

    def matrix(self, sample: Sample, multipliers: Sequence[Array], mu: float) -> Single:
        """H (n, n), rows and columns ordered robot, axis, mode."""
        problem, motion = self.lagrangian.problem, sample.motion
        H = self._of_ergodicity(sample)
        S = self.tables["u"]
        control = S.T @ S * np.float32(problem.control_weight / problem.steps)
        blocks = H.reshape(self.robots * self.nu, self.modes, self.robots * self.nu, self.modes)
        for block in range(len(blocks)):
            blocks[block, :, block] += control
        for constraint, (g, _), lam in zip(self.lagrangian.constraints, sample.evaluations, multipliers, strict=True):
            if isinstance(constraint, Curved):
                weights = np.maximum(lam + mu * g, 0.0)
                if weights.any():
                    self._add(H, constraint.rows(motion, weights), mu)
        return H

    def _of_ergodicity(self, sample: Sample) -> Single:
        """The share of log10 E."""
        problem = self.lagrangian.problem
        metric = problem.metric
        if not isinstance(metric, SquaresMetric):
            raise TypeError(f"{type(metric).__name__} is no sum of squares; see GaussNewton.of")
        rows = metric.squares(sample.motion.q[:-1], SQUARES)  # (k, N, ν, T)
        r = (rows.reshape(-1, rows.shape[-1]) @ self.tables["q"][:-1]).reshape(len(rows), -1)
        r *= np.float32(math.sqrt(2.0 * problem.ergodic_weight / ((sample.E + SMALLEST_E) * math.log(10.0))))
        H: Single = r.T @ r
        return H

    def _add(self, H: Single, rows: Rows, mu: float) -> None:
        """Add μ Σ ∇g ∇gᵀ, robot by robot or pair by pair."""
        table = self.tables[rows.part]
        moved = np.einsum("cm,cmk->mk", rows.shares.astype(np.float32), table[rows.samples])
        forces = np.zeros((len(rows.robots), self.nu, len(moved)), np.float32)
        forces[:, : rows.forces.shape[1]] = rows.forces * math.sqrt(mu)
        size = self.nu * self.modes
        groups, which = np.unique(rows.robots, axis=1, return_inverse=True)
        for number, robots in enumerate(groups.T):
            mine = np.flatnonzero(which == number)
            g = forces[:, :, mine].transpose(2, 0, 1)[..., None] * moved[mine, None, None]  # (m, r, ν, K)
            g = g.reshape(len(mine), len(robots), size)
            for a, i in enumerate(robots):
                for b, j in enumerate(robots):
                    H[i * size : (i + 1) * size, j * size : (j + 1) * size] += g[:, a].T @ g[:, b]

    def _blocked(self, z: Array) -> Single:
        """Rows (m, n) of variables, mode first, in the order used here."""
        by_mode = z.reshape(len(z), self.modes, -1)
        return np.ascontiguousarray(by_mode.swapaxes(1, 2), dtype=np.float32).reshape(len(z), -1)


class Factor(NamedTuple):
    """A Cholesky factor by blocks, which NumPy's products are fast with, and which it can solve triangles with.

    Attributes:
        L: (n, n) blocks below the diagonal. diagonal: inverses of the blocks on it.
    """

    L: Single
    diagonal: list[Single]

    @classmethod
    def of(cls, H: Single, size: int) -> Factor:
        """Of a symmetric matrix, which is overwritten, by blocks of ``size``.

        Raises:
            LinAlgError: it is not positive definite in single precision.
        """
        diagonal = []
        for a in range(0, len(H), size):
            e = a + size
            inverse = np.linalg.inv(np.linalg.cholesky(H[a:e, a:e]))
            diagonal.append(inverse)
            H[e:, a:e] = H[e:, a:e] @ inverse.T
            for b in range(e, len(H), size):
                H[b:, b : b + size] -= H[b:, a:e] @ H[b : b + size, a:e].T
        return cls(H, diagonal)

    def solve(self, x: Single) -> Single:
        """(L Lᵀ)⁻¹ x."""
        x, size = x.copy(), len(self.diagonal[0])
        edges = range(0, len(x), size)
        for a, inverse in zip(edges, self.diagonal, strict=True):
            x[a : a + size] = inverse @ (x[a : a + size] - self.L[a : a + size, :a] @ x[:a])
        for a, inverse in zip(reversed(edges), reversed(self.diagonal), strict=True):
            e = a + size
            x[a:e] = (x[a:e] - x[e:] @ self.L[e:, a:e]) @ inverse
        return x
