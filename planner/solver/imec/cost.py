"""The augmented cost of Algorithm 1 (IMEC, Eq. 19b), with the scales of the authors' published code.

J = r_E log10 E + ½ R mean_t uᵀu + r_b Σ barrier + 1/(2r) Σ (max(0, μ + r c)² − μ²)

over the constraints c ≤ 0: 0.1 (1 − P/ε_c), 0.1 (1 − d/ε_a) over the number of pairs, 0.1 (1 − d/r_o) over robots times
obstacles. A problem's own residuals are monotone functions of these, so they are mapped onto them, whatever else the
problem constrains is taken as it is. Control bounds are kept by clipping, the workspace by the barrier.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from missions.arrays import Array
from planner.constraints.acceleration import ControlBound
from planner.constraints.base import Constraint
from planner.constraints.connection import Connection
from planner.constraints.control_box import ControlBox
from planner.constraints.obstacles import Obstacles
from planner.constraints.paths import When
from planner.constraints.separation import Separation
from planner.constraints.solids import Outside
from planner.constraints.workspace import Inside
from planner.dynamics import Cotangent, Motion, StateGradient
from planner.problem import Problem
from planner.solver.imec.parameters import Parameters

SMALLEST_E = 1e-14  # log10 E stays finite
CLOSEST = 1e-3  # d/ε at which the slope of d/ε = √(1 − 2g/ε) is held


class Scaled(NamedTuple):
    """The paper's form of a residual g, and its slope dc/dg."""

    c: Array
    slope: Array


@dataclass
class Cost:
    """Evaluates J and its gradient; counts how often.

    Attributes:
        problem: what is solved. parameters: Table I.
        constraints: those in the augmented Lagrangian. box: the workspace, None if the problem has none.
        least: bounds of the controls, broadcastable to (T, N, m). largest: the same.
    """

    problem: Problem
    parameters: Parameters
    constraints: tuple[Constraint, ...]
    box: Inside | None
    least: Array
    largest: Array
    evaluations: int = 0

    @classmethod
    def of(cls, problem: Problem, parameters: Parameters) -> Cost:
        """The cost of a problem."""
        boxes = [c for c in problem.constraints if isinstance(c, Inside)]
        others = [c for c in problem.constraints if not isinstance(c, Inside | ControlBound | ControlBox)]
        others = [replace(c, quadrature=c.exact) if isinstance(c, Connection) else c for c in others]
        places = Separation | Obstacles | Outside
        others = [
            replace(c, when=When.SAMPLES) if isinstance(c, places) and c.when is When.ALWAYS else c for c in others
        ]
        least, largest = np.array(-math.inf), np.array(math.inf)
        for bound in problem.constraints:
            if isinstance(bound, ControlBound):
                least, largest = -bound.limit[:, None], bound.limit[:, None]
            elif isinstance(bound, ControlBox):
                least, largest = bound.lower, bound.upper
        return cls(problem, parameters, tuple(others), boxes[0] if boxes else None, least, largest)

    def rollout(self, u: Array) -> Motion:
        """Motion under controls clipped to their bounds; the paper looks at the first T steps and not between them."""
        motion = self.problem.dynamics.rollout(np.clip(u, self.least, self.largest))
        return motion._replace(q_fine=motion.q[:-1])

    def residuals(self, motion: Motion) -> tuple[Array, ...]:
        """Each constraint in the paper's form and scale."""
        return tuple(self._scaled(c, c.evaluate(motion).residual).c for c in self.constraints)

    def value(self, motion: Motion, multipliers: Sequence[Array], r: float) -> float:
        """J."""
        self.evaluations += 1
        value = self._objective(motion)
        for c, mu in zip(self.residuals(motion), multipliers, strict=True):
            active = np.maximum(mu + r * c, 0.0)
            value += (float(np.vdot(active, active)) - float(np.vdot(mu, mu))) / (2.0 * r)
        return value

    def gradient(self, motion: Motion, multipliers: Sequence[Array], r: float) -> StateGradient:
        """α and β: dJ by states and controls (Eq. 22, 24)."""
        problem = self.problem
        cotangent = Cotangent.zeros_like(motion)
        E, dE = problem.metric.evaluate(motion.q[:-1])
        cotangent.q[:-1] += dE * (problem.ergodic_weight / (max(E, SMALLEST_E) * math.log(10.0)))
        cotangent.u[...] += problem.control_weight / problem.steps * motion.u
        if self.box is not None:
            low, high = self._outside(motion)
            cotangent.q[:-1] += 2.0 * self.parameters.r_b * (high - low) / self._sides()
        for constraint, mu in zip(self.constraints, multipliers, strict=True):
            evaluation = constraint.evaluate(motion)
            scaled = self._scaled(constraint, evaluation.residual)
            active = np.maximum(mu + r * scaled.c, 0.0)
            if active.any():
                evaluation.pull(active * scaled.slope, cotangent)
        cotangent.q[:-1] += cotangent.q_fine
        return problem.dynamics.state_gradient(motion, cotangent)

    def _objective(self, motion: Motion) -> float:
        problem = self.problem
        E = max(problem.metric.value(motion.q[:-1]), SMALLEST_E)
        value = problem.ergodic_weight * math.log10(E)
        value += 0.5 * problem.control_weight / problem.steps * float(np.vdot(motion.u, motion.u))
        if self.box is not None:
            value += self.parameters.r_b * sum(float(np.vdot(part, part)) for part in self._outside(motion))
        return value

    def _outside(self, motion: Motion) -> tuple[Array, Array]:
        """Distance below and above the box, in its sides, (T, N, ν) each."""
        low, high = self._corners()
        q, sides = motion.q[:-1], high - low
        return np.maximum((low - q) / sides, 0.0), np.maximum((q - high) / sides, 0.0)

    def _sides(self) -> Array:
        low, high = self._corners()
        sides: Array = high - low
        return sides

    def _corners(self) -> tuple[Array, Array]:
        if self.box is None:
            raise TypeError("the problem has no workspace")
        return self.box.lower, self.box.upper

    def _scaled(self, constraint: Constraint, g: Array) -> Scaled:
        parameters = self.parameters
        if constraint.unit == "":  # g = log ε − log P
            share = parameters.r_c * np.exp(-g)  # r_c P/ε
            return Scaled(parameters.r_c - share, share)
        weight = parameters.r_a / max(g.size // len(self._instants(g)), 1)
        if isinstance(constraint, Separation):  # g = (ε² − d²)/2ε, over pairs and time
            return _distance(g, np.asarray(constraint.distance)[:, None], weight)
        if isinstance(constraint, Obstacles):  # g = (r² − d²)/2r, over robots, obstacles and time
            return _distance(g, np.asarray(constraint.radius)[..., None], weight)
        return Scaled(weight * g, np.full_like(g, weight))

    def _instants(self, g: Array) -> range:
        """The time axis of a residual, wherever it is."""
        lengths = (self.problem.steps, self.problem.steps + 1)
        return range(next((n for n in g.shape if n in lengths), 1))


def _distance(g: Array, limit: Array, weight: float) -> Scaled:
    ratio = np.sqrt(np.maximum(1.0 - 2.0 * g / limit, CLOSEST**2))  # d/ε
    return Scaled(weight * (1.0 - ratio), weight / (limit * ratio))
