"""The augmented Lagrangian of a problem and its gradient in the variables z.

L(z) = r_E log10 E + ½ R mean_t uᵀu + Σ_c 1/(2μ) Σ (max(0, λ + μ g)² − λ²)   (Powell, Hestenes, Rockafellar)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.constraints.base import Constraint
from planner.dynamics import Cotangent, Motion
from planner.problem import Problem
from planner.solver.modes import ControlModes

SMALLEST_E = 1e-14  # log10 E stays finite


@dataclass
class Lagrangian:
    """Evaluates, and counts how often.

    Attributes:
        problem: what is solved. modes: its variables. constraints: those in force, the problem's required ones first.
        evaluations: so far.
    """

    problem: Problem
    modes: ControlModes
    constraints: tuple[Constraint, ...]
    evaluations: int = 0

    def motion(self, z: Array) -> Motion:
        """Motion of the variables z (flat)."""
        _, robots, nu = self.problem.dynamics.controls_shape
        return self.problem.dynamics.rollout(self.modes.controls(z.reshape(-1, robots, nu)))

    def __call__(self, z: Array, multipliers: Sequence[Array], mu: float) -> tuple[float, Array]:
        """L and dL/dz (flat)."""
        self.evaluations += 1
        problem = self.problem
        motion = self.motion(z)
        cotangent = Cotangent.zeros_like(motion)

        E, dE = problem.metric.evaluate(motion.q[:-1])
        E = max(E, SMALLEST_E)
        value = problem.ergodic_weight * math.log10(E)
        cotangent.q[:-1] += dE * (problem.ergodic_weight / (E * math.log(10.0)))
        R = problem.control_weight / problem.steps
        value += 0.5 * R * float(np.vdot(motion.u, motion.u))
        cotangent.u[...] += R * motion.u

        for constraint, lam in zip(self.constraints, multipliers, strict=True):
            g, pull = constraint.evaluate(motion)
            active = np.maximum(lam + mu * g, 0.0)
            value += (float(np.vdot(active, active)) - float(np.vdot(lam, lam))) / (2.0 * mu)
            if active.any():
                pull(active, cotangent)
        gradient = self.modes.pull(problem.dynamics.pull(motion, cotangent))
        return value, gradient.ravel()
