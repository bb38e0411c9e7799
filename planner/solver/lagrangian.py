"""The augmented Lagrangian of a problem and its gradient in the variables z.

L(z) = r_E log10(E + 1e-8) + ½ R mean_t uᵀu + Σ_c 1/(2μ) Σ (max(0, λ + μ g)² − λ²)   (Powell, Hestenes, Rockafellar)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from missions.arrays import Array
from planner.constraints.base import Constraint, Evaluation, adapted
from planner.dynamics import Cotangent, Motion
from planner.ergodic.metric import MetricValue
from planner.problem import Problem
from planner.solver.modes import ControlModes

SMALLEST_E = 1e-8  # added to E: what is lower does not matter, and must not outweigh the limits


class Sample(NamedTuple):
    """All that is known at one z, whatever the multipliers and the penalty."""

    z: Array
    motion: Motion
    ergodicity: MetricValue
    evaluations: tuple[Evaluation, ...]

    @property
    def E(self) -> float:
        """Ergodicity."""
        return self.ergodicity.value

    @property
    def residuals(self) -> tuple[Array, ...]:
        """One array a constraint."""
        return tuple(evaluation.residual for evaluation in self.evaluations)


@dataclass
class Lagrangian:
    """Evaluates, and counts how often.

    Attributes:
        problem: what is solved. modes: its variables. constraints: those in force, the problem's required ones first.
        evaluations: so far.
        last: the latest sample: between rounds, only multipliers and penalty change.
    """

    problem: Problem
    modes: ControlModes
    constraints: tuple[Constraint, ...]
    evaluations: int = 0
    last: Sample | None = None

    def motion(self, z: Array) -> Motion:
        """Motion of the variables z (flat)."""
        _, robots, nu = self.problem.dynamics.controls_shape
        return self.problem.dynamics.rollout(self.modes.controls(z.reshape(-1, robots, nu)))

    def adapt(self, motion: Motion) -> None:
        """Let constraints that choose what they ask for choose anew; between rounds only, to keep rounds smooth."""
        adjusted = tuple(adapted(constraint, motion) for constraint in self.constraints)
        if any(new is not old for new, old in zip(adjusted, self.constraints, strict=True)):
            self.constraints, self.last = adjusted, None

    def at(self, z: Array) -> Sample:
        """Metric and constraints at z; for nothing if this very z came last."""
        if self.last is not None and self.last.z is z and len(self.last.evaluations) == len(self.constraints):
            return self.last
        self.evaluations += 1
        motion = self.motion(z)
        ergodicity = self.problem.metric.evaluate(motion.q[:-1])
        self.last = Sample(z, motion, ergodicity, tuple(c.evaluate(motion) for c in self.constraints))
        return self.last

    def __call__(self, z: Array, multipliers: Sequence[Array], mu: float) -> tuple[float, Array]:
        """L and dL/dz (flat)."""
        problem, sample = self.problem, self.at(z)
        motion = sample.motion
        cotangent = Cotangent.zeros_like(motion)

        E = sample.E + SMALLEST_E
        value = problem.ergodic_weight * math.log10(E)
        cotangent.q[:-1] += sample.ergodicity.gradient * (problem.ergodic_weight / (E * math.log(10.0)))
        R = problem.control_weight / problem.steps
        value += 0.5 * R * float(np.vdot(motion.u, motion.u))
        cotangent.u[...] += R * motion.u

        for (g, pull), lam in zip(sample.evaluations, multipliers, strict=True):
            active = np.maximum(lam + mu * g, 0.0)
            value += (float(np.vdot(active, active)) - float(np.vdot(lam, lam))) / (2.0 * mu)
            if active.any():
                pull(active, cotangent)
        gradient = self.modes.pull(problem.dynamics.pull(motion, cotangent))
        return value, gradient.ravel()
