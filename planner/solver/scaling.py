"""Which change of variables a problem is searched in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.dynamics import Dynamics
from planner.problem import Problem
from planner.solver.ends import with_ends
from planner.solver.modes import ControlModes, Weights, control_modes

ITSELF = 1.0  # weight of a control beside its slope [1/s²]: it has bounds, and may move nothing else


def scaled_modes(problem: Problem) -> ControlModes:
    """Modes of accelerations from rest to rest, or free modes of whatever else the controls are."""
    weights = Weights() if problem.modes is None else Weights(modes=problem.modes, packets=problem.modes // 2)
    rests = problem.dynamics.rests
    modes = control_modes(problem.steps, problem.dt, weights) if rests else free_modes(problem, weights)
    return with_ends(modes, problem)


@dataclass(frozen=True)
class FreeModes(ControlModes):
    """Modes about a control that is not zero, each control scaled by itself.

    Attributes:
        S: (m, T, K) of each control, per its unit.
        origin: (m,) controls of z = 0. unit: (m,) of each control.
    """

    origin: Array
    unit: Array

    def controls(self, z: Array) -> Array:
        """Controls (T, N, m) of variables z (K, N, m)."""
        each: Array = self.S @ z.transpose(2, 0, 1)  # (m, T, N)
        u: Array = self.origin + self.unit * each.transpose(1, 2, 0)
        return u

    def pull(self, to_u: Array) -> Array:
        """Gradient with respect to z of a gradient with respect to u."""
        to_z: Array = self.S.swapaxes(1, 2) @ (to_u * self.unit).transpose(2, 0, 1)  # (m, K, N)
        return np.ascontiguousarray(to_z.transpose(1, 2, 0))

    def variables(self, u: Array) -> Array:
        """The z whose controls are nearest to u (least squares)."""
        each = np.moveaxis((u - self.origin) / self.unit, -1, 0)  # (m, T, N)
        z = [np.linalg.lstsq(S, part, rcond=None)[0] for S, part in zip(self.S, each, strict=True)]
        return np.ascontiguousarray(np.stack(z, axis=-1))


def free_modes(problem: Problem, weights: Weights) -> FreeModes:
    """Cosine modes φ_k(t) = cos(π k (t+½)/T), k = 0..K−1, scaled by what each control does to position and velocity.

    The quadratic model is that of accelerations, with the model's own response in place of the double integrator's:
    weight R on a control and its slope, Qv on the velocity and Qq on the position it leads to. For models that are not
    linear the response is that at the origin: a guess at the size of things, L-BFGS learns the rest.
    """
    steps, dt = problem.steps, problem.dt
    origin, unit = problem.dynamics.control_scale
    k = np.arange(min(weights.modes, steps))
    phase = np.pi / steps * np.outer(np.arange(steps) + 0.5, k)
    Phi, slope = np.cos(phase), -np.sin(phase) * (np.pi * k / (steps * dt))
    effort = weights.R * (slope.T @ slope + ITSELF * Phi.T @ Phi)
    S = np.empty((len(unit), steps, len(k)))
    for control, (to_q, to_v) in enumerate(_responses(problem.dynamics, dt)):
        M = effort.copy()
        for response, weight in ((to_v, weights.Qv), (to_q, weights.Qq)):
            for axis in response.T:
                X = _convolved(unit[control] * axis, Phi)
                M += weight * X.T @ X
        S[control] = np.linalg.solve(np.linalg.cholesky(M), Phi.T).T
    return FreeModes(S, origin, unit)


def _responses(dynamics: Dynamics, dt: float) -> Iterator[tuple[Array, Array]]:
    """Of each control: positions and velocities (T, ν) after a push of one unit for one step, at the origin."""
    steps, robots, m = dynamics.controls_shape
    origin, _ = dynamics.control_scale
    motion = dynamics.rollout(np.broadcast_to(origin, (steps, robots, m)).copy())
    A, B = (part.mean(axis=(0, 1)) for part in dynamics.linearise(motion))
    n, nu = len(A), motion.q.shape[2]
    onwards = np.linalg.inv(np.eye(n) - dt * A)  # implicit, so that no lag is too short for the step
    for control in range(m):
        x = onwards @ (dt * B[:, control])
        states = np.empty((steps, n))
        for t in range(steps):
            states[t] = x
            x = onwards @ x
        to_v = states @ A[:nu].T
        to_v[0] += B[:nu, control]
        yield states[:, :nu], to_v


def _convolved(response: Array, Phi: Array) -> Array:
    """(T, K) responses to the modes."""
    T = len(response)
    lag = np.arange(T)[:, None] - np.arange(T)
    toeplitz = np.where(lag >= 0, response[lag], 0.0)
    X: Array = toeplitz @ Phi
    return X
