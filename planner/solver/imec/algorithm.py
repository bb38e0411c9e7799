"""Algorithm 1 of the IMEC paper: init / step / terminate over a named state."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from missions.arrays import Array
from planner.dynamics import Motion
from planner.solver.imec.cost import Cost
from planner.solver.imec.riccati import Gains, minimiser, solve_riccati

COARSE = 5  # the line search tries every fifth step first


@dataclass(frozen=True)
class State:
    """Between two iterations.

    Attributes:
        u: (T, N, m) controls, within their bounds. motion: theirs.
        multipliers: μ ≥ 0, one array a constraint. r: penalty. eps_J: decrease of J above which multipliers move.
        J: augmented cost of the motion at the end of the iteration, before multipliers or penalty moved.
        change: the same of the iteration before minus this one's, as the authors' code compares them.
        violation: sum of the scaled violations, as the paper's termination criterion has it.
        step: index of the line search's last step, 0.8^step. iteration: done so far.
    """

    u: Array
    motion: Motion
    multipliers: tuple[Array, ...]
    r: float
    eps_J: float
    J: float
    change: float
    violation: float
    step: int
    iteration: int


def init(cost: Cost, u: Array) -> State:
    """State before the first iteration (line 1): multipliers from the constraints of the first guess."""
    parameters = cost.parameters
    motion = cost.rollout(u)
    residuals = cost.residuals(motion)
    multipliers = tuple(np.maximum(parameters.r * c, 0.0) for c in residuals)
    J = cost.value(motion, multipliers, parameters.r)
    violation = _violation(residuals)
    return State(motion.u, motion, multipliers, parameters.r, parameters.eps_J, J, math.inf, violation, 0, 0)


def step(cost: Cost, state: State) -> State:
    """Lines 3 to 14: LQR direction, line search, then multipliers or penalty."""
    parameters = cost.parameters
    before = cost.value(state.motion, state.multipliers, state.r)
    alpha, beta = cost.gradient(state.motion, state.multipliers, state.r)
    direction = minimiser(gains_of(cost, state.motion), alpha, beta)
    index, motion, after = line_search(cost, state, direction, before)
    residuals = cost.residuals(motion)
    multipliers, r, eps_J = state.multipliers, state.r, state.eps_J
    change = state.J - after
    if change > eps_J:
        multipliers = tuple(np.maximum(mu + r * c, 0.0) for mu, c in zip(multipliers, residuals, strict=True))
    else:
        r, eps_J = r * parameters.alpha_r, eps_J * parameters.alpha_J
    return replace(
        state,
        u=motion.u,
        motion=motion,
        multipliers=multipliers,
        r=r,
        eps_J=eps_J,
        J=after,
        change=change,
        violation=_violation(residuals),
        step=index,
        iteration=state.iteration + 1,
    )


def terminate(cost: Cost, state: State) -> bool:
    """The paper's criterion: J has settled and the scaled violations sum to less than 0.01."""
    parameters = cost.parameters
    return abs(state.change) < parameters.settled and state.violation < parameters.violation


def line_search(cost: Cost, state: State, direction: Array, before: float) -> tuple[int, Motion, float]:
    """The best of the steps 0.8^k along the clipped path.

    The authors' code tries all fifty. Every fifth, then downhill from the best of them, costs a third and finds the
    same valley: along the path J is smooth on the scale of five steps' ratio.
    """
    tried: dict[int, tuple[float, Motion]] = {}

    def value(index: int) -> float:
        if index not in tried:
            motion = cost.rollout(state.u + cost.parameters.backtrack**index * direction)
            tried[index] = cost.value(motion, state.multipliers, state.r), motion
        return tried[index][0]

    steps = cost.parameters.steps
    best = min((*range(0, steps, COARSE), state.step), key=value)
    for towards in (-1, 1):
        while 0 <= best + towards < steps and value(best + towards) < value(best):
            best += towards
    if value(best) > before:
        return state.step, state.motion, before  # no step descends: the penalty grows
    return best, tried[best][1], value(best)


def gains_of(cost: Cost, motion: Motion) -> Gains:
    """Gains along a motion.

    Clipping belongs to the dynamics that are linearised: a control on its bound has the mean of the slopes on both
    sides, one half, which is also what automatic differentiation makes of it in the authors' code. Without it the run
    leaves theirs at the first control that saturates.
    """
    parameters, problem = cost.parameters, cost.problem
    linear = problem.dynamics.linearise(motion)
    saturated = (motion.u <= cost.least) | (motion.u >= cost.largest)
    if saturated.any():
        linear = linear._replace(B=linear.B * np.where(saturated, 0.5, 1.0)[:, :, None])
    n, m = linear.B.shape[2:]
    weights = np.where(np.arange(n) < motion.q.shape[2], parameters.Qq, parameters.Qv)
    return solve_riccati(linear, problem.steps, problem.dt, np.diag(weights), parameters.R * np.eye(m))


def _violation(residuals: tuple[Array, ...]) -> float:
    return float(sum(np.maximum(c, 0.0).sum() for c in residuals))
