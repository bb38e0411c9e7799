"""Which change of variables a problem is searched in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.problem import Problem
from planner.solver.ends import with_ends
from planner.solver.modes import ControlModes, Weights, control_modes


def scaled_modes(problem: Problem) -> ControlModes:
    """Modes of accelerations from rest to rest, or free modes of whatever else the controls are."""
    weights = Weights() if problem.modes is None else Weights(modes=problem.modes, packets=problem.modes // 2)
    rests = problem.dynamics.rests
    modes = control_modes(problem.steps, problem.dt, weights) if rests else free_modes(problem, weights)
    return with_ends(modes, problem)


@dataclass(frozen=True)
class FreeModes(ControlModes):
    """Modes about a control that is not zero, each control in its own unit.

    Attributes:
        origin: (m,) controls of z = 0. unit: (m,) of each control.
    """

    origin: Array
    unit: Array

    def controls(self, z: Array) -> Array:
        """Controls (T, N, m) of variables z (K, N, m)."""
        return self.origin + self.unit * super().controls(z)

    def pull(self, to_u: Array) -> Array:
        """Gradient with respect to z of a gradient with respect to u."""
        return super().pull(to_u * self.unit)

    def variables(self, u: Array) -> Array:
        """The z whose controls are nearest to u (least squares)."""
        return super().variables((u - self.origin) / self.unit)


def free_modes(problem: Problem, weights: Weights) -> FreeModes:
    """Cosine modes φ_k(t) = cos(π k (t+½)/T), k = 0..K−1, scaled as if the controls were velocities.

    The quadratic model is the same as for accelerations, one integration less: weight R on the control's slope, Qv on
    the control, Qq on its integral. For models that are not linear it is a guess at the size of things, no more:
    L-BFGS learns the rest.
    """
    steps, dt = problem.steps, problem.dt
    k = np.arange(min(weights.modes, steps))
    phase = np.pi / steps * np.outer(np.arange(steps) + 0.5, k)
    Phi, slope = np.cos(phase), -np.sin(phase) * (np.pi * k / (steps * dt))
    X = np.cumsum(Phi, axis=0) * dt
    M = weights.R * slope.T @ slope + weights.Qv * Phi.T @ Phi + weights.Qq * X.T @ X
    S = np.linalg.solve(np.linalg.cholesky(M), Phi.T).T
    return FreeModes(S, *problem.dynamics.control_scale)
