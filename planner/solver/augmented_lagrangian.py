"""The augmented Lagrangian method: init / step / terminate over a named state.

Starts soft: with a small penalty the robots first spread over the information and find each other, and the limits
harden round by round. A stiff start freezes the first tangle the robots are in, at an E orders of magnitude higher.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from missions.arrays import Array
from planner.constraints.base import Constraint
from planner.dynamics import Motion
from planner.solver.lagrangian import Lagrangian
from planner.solver.lbfgs import Memory, Point, minimise

METRE_TOLERANCE = 1e-3  # [m] what one tolerance of any unit is worth when violations are compared


@dataclass(frozen=True)
class Schedule:
    """How the penalty grows and how much work a round is.

    Attributes:
        penalty: μ of the first round. growth: factor a round. largest: μ stays below.
        iterations: of L-BFGS a round; few, since multipliers that move early save more than exact minima.
        rounds: at most. memory: of L-BFGS.
        settled: relative change of E over two rounds below which it counts as settled.
        starts: random first guesses that race. heat: rounds after which the better half goes on: motions that differ
            at the start end in different minima, and who leads early mostly wins, at a fraction of the work.
    """

    penalty: float = 0.1
    growth: float = 1.25
    largest: float = 1e5
    iterations: int = 20
    rounds: int = 90
    memory: int = 20
    settled: float = 0.02
    starts: int = 8
    heat: int = 4


@dataclass(frozen=True)
class State:
    """Between two rounds.

    Attributes:
        z: variables (flat). motion: theirs. E: ergodicity.
        multipliers: λ ≥ 0, one array a constraint. mu: penalty of the next round.
        violation: worst miss of a required constraint, preference: of a preferred one [m equivalent].
        round: rounds done. recent: E after each of them.
    """

    # Updated by every inner minimisation
    z: Array
    motion: Motion
    E: float
    violation: float
    preference: float
    # Updated between them
    multipliers: tuple[Array, ...]
    mu: float
    round: int
    recent: tuple[float, ...]


def init(lagrangian: Lagrangian, z: Array, schedule: Schedule) -> State:
    """State before the first round."""
    motion = lagrangian.motion(z)
    multipliers = tuple(np.zeros_like(c.evaluate(motion).residual) for c in lagrangian.constraints)
    E = lagrangian.problem.metric.value(motion.q[:-1])
    return State(z, motion, E, math.inf, math.inf, multipliers, schedule.penalty, 0, ())


def step(
    lagrangian: Lagrangian, state: State, schedule: Schedule, memory: Memory, keep_going: Callable[[], bool]
) -> State:
    """One round: minimise with fixed multipliers, update them, raise the penalty."""

    def objective(z: Array) -> tuple[float, Array]:
        return lagrangian(z, state.multipliers, state.mu)

    f, g = objective(state.z)
    point = minimise(
        objective,
        Point(state.z, f, g),
        memory,
        max_iterations=schedule.iterations,
        gradient_tolerance=1e-6,
        keep_going=keep_going,
    )
    motion = lagrangian.motion(point.z)
    multipliers = tuple(
        np.maximum(0.0, lam + state.mu * constraint.evaluate(motion).residual)
        for lam, constraint in zip(state.multipliers, lagrangian.constraints, strict=True)
    )
    E = lagrangian.problem.metric.value(motion.q[:-1])
    violation, preference = misses(lagrangian, motion)
    return replace(
        state,
        z=point.z,
        motion=motion,
        E=E,
        violation=violation,
        preference=preference,
        multipliers=multipliers,
        mu=min(state.mu * schedule.growth, schedule.largest),
        round=state.round + 1,
        recent=(*state.recent, E),
    )


def terminate(state: State, schedule: Schedule) -> bool:
    """Whether every limit is met, preferences too, and E no longer falls; or the rounds are used up."""
    if state.round >= schedule.rounds:
        return True
    return max(state.violation, state.preference) <= METRE_TOLERANCE and settled(state, schedule)


def settled(state: State, schedule: Schedule) -> bool:
    """Whether E changed little over the last two rounds."""
    if len(state.recent) < 3:
        return False
    return abs(math.log(state.recent[-1] / state.recent[-3])) <= schedule.settled


def merit(lagrangian: Lagrangian, state: State) -> float:
    """Objective plus penalty at the state's own μ, without multipliers: comparable between states of one round."""
    none = tuple(np.zeros_like(lam) for lam in state.multipliers)
    return lagrangian(state.z, none, state.mu)[0]


def misses(lagrangian: Lagrangian, motion: Motion) -> tuple[float, float]:
    """Worst miss of required constraints, and of preferred ones in force [m equivalent]; negative if there is room."""
    required = lagrangian.problem.constraints
    preferred = lagrangian.constraints[len(required) :]
    return worst_miss(required, motion), worst_miss(preferred, motion)


def worst_miss(constraints: Sequence[Constraint], motion: Motion) -> float:
    """Largest violation in tolerances, as a length [m equivalent]."""
    return max(
        (METRE_TOLERANCE * float(c.violation(motion).max()) / c.tolerance for c in constraints), default=-math.inf
    )
