"""Several swarms of one problem at once: what an evaluation costs is mostly calls, not arithmetic.

A stack of B swarms is one motion of B·N robots, swarm after swarm. Constraints hold within each swarm only, ergodicity
and penalty are worked out swarm by swarm, and each swarm has variables, multipliers and a penalty parameter of its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.constraints.base import Constraint, Stackable
from planner.dynamics import Cotangent, DoubleIntegrator, Motion
from planner.ergodic.metric import SwarmMetric
from planner.problem import Problem
from planner.solver.lagrangian import SMALLEST_E
from planner.solver.modes import ControlModes
from planner.solver.scaling import scaled_modes


def stackable(problem: Problem) -> bool:
    """Whether swarms of the problem can be stacked."""
    constraints = (*problem.constraints, *problem.preferences)
    known = isinstance(problem.dynamics, DoubleIntegrator) and isinstance(problem.metric, SwarmMetric)
    return known and all(isinstance(constraint, Stackable) for constraint in constraints)


def stacked(problem: Problem, swarms: int) -> Problem:
    """The problem of several swarms, without its metric's view of them (see :class:`Stack`)."""
    dynamics = problem.dynamics
    if not isinstance(dynamics, DoubleIntegrator):
        raise TypeError(f"{type(dynamics).__name__} moves no more than one swarm; see stackable()")
    robots = dynamics.controls_shape[1]
    velocity, acceleration = (
        None if value is None else np.tile(value, (swarms, 1)) for value in (dynamics.velocity, dynamics.acceleration)
    )
    return replace(
        problem,
        dynamics=replace(
            dynamics, start=np.tile(dynamics.start, (swarms, 1)), velocity=velocity, acceleration=acceleration
        ),
        constraints=tuple(_stacked(constraint, swarms, robots) for constraint in problem.constraints),
        preferences=tuple(_stacked(constraint, swarms, robots) for constraint in problem.preferences),
        ends=None if problem.ends is None else np.tile(problem.ends, (swarms, 1)),
        coarse=None,
    )


def _stacked(constraint: Constraint, swarms: int, robots: int) -> Constraint:
    return _stackable(constraint).stacked(swarms, robots)


def _before(constraint: Constraint, motion: Motion) -> int:
    """Number of components of the residual before the swarm axis."""
    return math.prod(constraint.evaluate(motion).residual.shape[: _stackable(constraint).swarm_axis])


def _stackable(constraint: Constraint) -> Stackable:
    if not isinstance(constraint, Stackable):
        raise TypeError(f"{type(constraint).__name__} holds no more than one swarm; see stackable()")
    return constraint


def _ergodic(problem: Problem) -> SwarmMetric:
    if not isinstance(problem.metric, SwarmMetric):
        raise TypeError(f"{type(problem.metric).__name__} measures no more than one swarm; see stackable()")
    return problem.metric


@dataclass(frozen=True)
class StackValue:
    """The augmented Lagrangians of a stack at a point.

    Attributes:
        L: (B,) values. gradient: (B, n). E: (B,) ergodicities. merit: (B,) L without multipliers.
        worst: (B,) largest residual of any constraint, in tolerances.
        motion: of all swarms.
    """

    L: Array
    gradient: Array
    E: Array
    merit: Array
    worst: Array
    motion: Motion


class Stack:
    """B swarms of a problem, their multipliers and penalties.

    Attributes:
        swarms: B. multipliers: one array a constraint, (before, B, after) its swarm axis. mu: (B,).
    """

    def __init__(self, problem: Problem, swarms: int) -> None:
        self.swarms = swarms
        self.problem = stacked(problem, swarms)
        self.modes: ControlModes = scaled_modes(self.problem)
        self.constraints = (*self.problem.constraints, *self.problem.preferences)
        self.mu = np.ones(swarms)
        self.multipliers: list[Array] = []
        self.pressed: list[bool] = []  # constraints with multipliers that are not all zero
        still = self.problem.dynamics.rollout(np.zeros(self.problem.dynamics.controls_shape))
        self.before = [_before(constraint, still) for constraint in self.constraints]
        self.metric = _ergodic(problem)

    def load(self, swarm: int, multipliers: Sequence[Array], mu: float) -> None:
        """Give a swarm the multipliers and the penalty of a state."""
        split = [lam.reshape(before, -1) for lam, before in zip(multipliers, self.before, strict=True)]
        if not self.multipliers:
            self.multipliers = [np.zeros((len(lam), self.swarms, lam.shape[1])) for lam in split]
        for mine, lam in zip(self.multipliers, split, strict=True):
            mine[:, swarm] = lam
        self.pressed = [bool(lam.any()) for lam in self.multipliers]
        self.mu[swarm] = mu

    def saved(self, swarm: int, like: Sequence[Array]) -> tuple[Array, ...]:
        """A swarm's multipliers, in the shapes of the problem's own."""
        return tuple(lam[:, swarm].reshape(zero.shape).copy() for lam, zero in zip(self.multipliers, like, strict=True))

    def evaluate(self, z: Array, turn: NDArray[np.bool_], growth: float, largest: float) -> StackValue:
        """Lagrangians at z (B, n); multipliers and penalties of swarms whose ``turn`` it is are updated first."""
        swarms, problem = self.swarms, self.problem
        _, total, nu = problem.dynamics.controls_shape
        robots = total // swarms
        in_modes = z.reshape(swarms, -1, robots, nu).swapaxes(0, 1).reshape(-1, total, nu)
        motion = problem.dynamics.rollout(self.modes.controls(in_modes))
        cotangent = Cotangent.zeros_like(motion)

        E, to_q = self._ergodicity(motion)
        R, weight = problem.control_weight / problem.steps, problem.ergodic_weight
        L = weight * np.log10(E + SMALLEST_E)
        per_robot = np.repeat(weight / ((E + SMALLEST_E) * math.log(10.0)), robots)
        cotangent.q[:-1] += to_q * per_robot[:, None]
        u = motion.u.reshape(-1, swarms, robots * nu)
        L += 0.5 * R * np.einsum("tbm,tbm->b", u, u)
        cotangent.u[...] += R * motion.u

        merit, worst = L.copy(), np.full(swarms, -math.inf)
        old = self.mu.copy()
        self.mu[turn] = np.minimum(old[turn] * growth, largest)
        any_turn = bool(turn.any())
        for number, constraint in enumerate(self.constraints):
            g, pull = constraint.evaluate(motion)
            split, lam = g.reshape(self.before[number], swarms, -1), self.multipliers[number]
            if any_turn:
                self._close_round(split, number, turn, old)
                over = np.maximum(split[:, turn], 0.0)
                merit[turn] += 0.5 * self.mu[turn] * np.einsum("abc,abc->b", over, over)
                worst[turn] = np.maximum(worst[turn], split[:, turn].max(axis=(0, 2)) / constraint.tolerance)
            if not self.pressed[number] and float(split.max()) <= 0.0:
                continue  # no multipliers and nothing missed: no penalty
            active = self.mu[:, None] * split
            active += lam
            np.maximum(active, 0.0, out=active)
            penalty = np.einsum("abc,abc->b", active, active) - np.einsum("abc,abc->b", lam, lam)
            L += penalty / (2.0 * self.mu)
            pull(active.reshape(g.shape), cotangent)
        to_z = self.modes.pull(problem.dynamics.pull(motion, cotangent))
        gradient = to_z.reshape(-1, swarms, robots * nu).swapaxes(0, 1).reshape(swarms, -1)
        return StackValue(L, gradient, E, merit, worst, motion)

    def _ergodicity(self, motion: Motion) -> tuple[Array, Array]:
        """E (B,) of every swarm and its gradient (T, B·N, ν)."""
        steps, total, nu = motion.u.shape
        by_swarm = motion.q[:-1].reshape(steps, self.swarms, -1, nu).swapaxes(0, 1)
        E, gradient = self.metric.evaluate_each(by_swarm.reshape(self.swarms, -1, nu))
        return E, gradient.reshape(self.swarms, steps, -1, nu).swapaxes(0, 1).reshape(steps, total, nu)

    def _close_round(self, split: Array, number: int, turn: NDArray[np.bool_], mu: Array) -> None:
        """Update the multipliers of swarms whose ``turn`` it is, from a residual (before, B, after)."""
        lam = self.multipliers[number]
        lam[:, turn] = np.maximum(lam[:, turn] + mu[turn, None] * split[:, turn], 0.0)
        self.pressed[number] = bool(lam.any())
