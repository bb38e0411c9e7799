"""The augmented Lagrangian method: init / step / terminate over a named state.

Starts soft: with a small penalty the robots first spread over the information and find each other, and the limits
harden round by round. A stiff start freezes the first tangle the robots are in, at an E orders of magnitude higher.

Rounds are short, a few iterations, and the penalty grows slowly: multipliers that keep up with the motion lead to a
median E half of that of long rounds with the same number of evaluations.

How slowly follows E. While E still changes much from round to round, the penalty hardly grows: what the motion does not
find while it is soft it pays for later, since a stiff problem is ill-conditioned and E creeps. Once E is lower than
matters, there is nothing to wait for, and the penalty grows fast.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from missions.arrays import Array
from planner.constraints.base import Constraint
from planner.dynamics import Motion
from planner.solver.gauss_newton import GaussNewton
from planner.solver.lagrangian import Lagrangian, Sample
from planner.solver.lbfgs import Memory, Point, minimise
from planner.solver.misses import METRE_TOLERANCE

ROUGH = 5.0  # tolerances of violation below which it is worked out exactly


@dataclass(frozen=True)
class Schedule:
    """How the penalty grows and how much work a round is.

    Attributes:
        penalty: μ of the first round. growth: factor a round of searches that are compared. largest: μ stays below.
        lingering, calm: factor a round of a search on its own while E changes by at least ``steep`` a round
            (relative), and while it does not. hurrying: after ``unhurried`` rounds. pressing: of models that are dear.
            rushing: once E is negligible.
        iterations: of L-BFGS a round. rounds: at most. memory: of L-BFGS.
        settled: relative change of E over ``window`` rounds below which it counts as settled.
        negligible: E that is low enough: a flight's tracking error of a centimetre moves E by far more.
        patience: rounds without the violation falling after which the limits count as contradictory, once the penalty
            is ``stiff``: while it is soft, a low E outweighs what is missed.
    """

    penalty: float = 0.1
    growth: float = 1.07
    lingering: float = 1.015
    calm: float = 1.03
    hurrying: float = 1.1
    pressing: float = 1.15
    rushing: float = 1.3
    steep: float = 0.02
    unhurried: int = 120
    largest: float = 1e4
    iterations: int = 5
    rounds: int = 300
    memory: int = 20
    settled: float = 0.02
    window: int = 8
    negligible: float = 5e-7
    patience: int = 60
    stiff: float = 30.0

    @property
    def informed(self) -> Schedule:
        """The same for searches that know the curvature of their problem: longer rounds, and fewer of them.

        A round of four times as many iterations gets so much farther that the penalty may grow by more after it.
        """
        return replace(
            self,
            lingering=1.3,
            calm=1.3,
            hurrying=1.3,
            rushing=3.0,
            iterations=4 * self.iterations,
            rounds=max(self.rounds // 4, 1),
            window=2,
            patience=10,
        )

    @property
    def steady(self) -> Schedule:
        """The same with a penalty that grows alike for all, so that searches can be compared after as many rounds."""
        return replace(self, lingering=self.growth, calm=self.growth, hurrying=self.growth, rushing=self.growth)

    @property
    def hurried(self) -> Schedule:
        """The same for models an evaluation of which is dear: as soon as E settles, limits are what is left to do."""
        return replace(self, calm=self.pressing, hurrying=self.pressing)


@dataclass(frozen=True)
class State:
    """Between two rounds.

    Attributes:
        z: variables (flat). motion: theirs. E: ergodicity.
        multipliers: λ ≥ 0, one array a constraint. mu: penalty of the next round.
        violation: worst miss of a required constraint, preference: of a preferred one [m equivalent].
        round: rounds done. recent: E, misses: violation after each of them.
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
    misses: tuple[float, ...]


def init(lagrangian: Lagrangian, z: Array, schedule: Schedule) -> State:
    """State before the first round."""
    sample = lagrangian.at(z)
    multipliers = tuple(np.zeros_like(g) for g in sample.residuals)
    return State(z, sample.motion, sample.E, math.inf, math.inf, multipliers, schedule.penalty, 0, (), ())


def step(
    lagrangian: Lagrangian,
    state: State,
    schedule: Schedule,
    memory: Memory,
    keep_going: Callable[[], bool],
    model: GaussNewton | None = None,
) -> State:
    """One round: minimise with fixed multipliers, update them, raise the penalty; with a ``model``, around that."""
    lagrangian.adapt(state.motion)
    inverse = None
    if model is not None:
        inverse = model.inverse(lagrangian.at(state.z), state.multipliers, state.mu, memory)

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
        inverse=inverse,
    )
    sample = lagrangian.at(point.z)
    multipliers = tuple(
        np.maximum(0.0, lam + state.mu * g) for lam, g in zip(state.multipliers, sample.residuals, strict=True)
    )
    violation, preference = misses(lagrangian, sample)
    return replace(
        state,
        z=point.z,
        motion=sample.motion,
        E=sample.E,
        violation=violation,
        preference=preference,
        multipliers=multipliers,
        mu=min(state.mu * pace(state, sample.E, schedule), schedule.largest),
        round=state.round + 1,
        recent=(*state.recent, sample.E),
        misses=(*state.misses, violation),
    )


def pace(state: State, E: float, schedule: Schedule) -> float:
    """By what the penalty grows after a round that brought ``E``: little while E changes much."""
    if schedule.negligible >= E:
        return schedule.rushing
    if state.round >= schedule.unhurried:
        return schedule.hurrying
    steep = not state.recent or abs(math.log(E / state.recent[-1])) >= schedule.steep
    return schedule.lingering if steep else schedule.calm


def terminate(state: State, schedule: Schedule) -> bool:
    """Whether every limit is met, preferences too, and E no longer falls or matters; or there is no use going on."""
    if state.round >= schedule.rounds or hopeless(state, schedule):
        return True
    return max(state.violation, state.preference) <= METRE_TOLERANCE and settled(state, schedule)


def settled(state: State, schedule: Schedule) -> bool:
    """Whether E changed little over the last rounds, or is lower than matters."""
    if schedule.negligible >= state.E:
        return True
    if len(state.recent) <= schedule.window:
        return False
    return abs(math.log(state.recent[-1] / state.recent[-1 - schedule.window])) <= schedule.settled


def hopeless(state: State, schedule: Schedule) -> bool:
    """Whether limits are missed although penalties are large and have been growing for long."""
    if len(state.misses) <= 2 * schedule.patience or state.mu < schedule.stiff:
        return False
    lately, before = min(state.misses[-schedule.patience :]), min(state.misses[: -schedule.patience])
    return lately > 10.0 * METRE_TOLERANCE and lately > 0.9 * before


def merit(lagrangian: Lagrangian, state: State) -> float:
    """Objective plus penalty at the state's own μ, without multipliers: comparable between states of one round."""
    lagrangian.adapt(state.motion)
    none = tuple(np.zeros_like(lam) for lam in state.multipliers)
    return lagrangian(state.z, none, state.mu)[0]


def misses(lagrangian: Lagrangian, sample: Sample) -> tuple[float, float]:
    """Worst miss of required constraints, and of preferred ones in force [m equivalent]; negative if there is room.

    Far from feasible, the residuals of the search say it; close to it, the constraints' exact violations.
    """
    required = len(lagrangian.problem.constraints)
    rough = [worst(g, c) for g, c in zip(sample.residuals, lagrangian.constraints, strict=True)]
    found = []
    for chosen in (slice(None, required), slice(required, None)):
        amount = max(rough[chosen], default=-math.inf)
        if amount <= ROUGH * METRE_TOLERANCE:
            constraints = lagrangian.constraints[chosen]
            amount = max((worst(c.violation(sample.motion), c) for c in constraints), default=-math.inf)
        found.append(amount)
    return found[0], found[1]


def measured(lagrangian: Lagrangian, state: State) -> State:
    """A state whose violation was read off residuals, with the exact one where it is small enough to matter."""
    if max(state.violation, state.preference) > ROUGH * METRE_TOLERANCE:
        return state
    violation, preference = misses(lagrangian, lagrangian.at(state.z))
    return replace(state, violation=violation, preference=preference)


def worst(amounts: Array, constraint: Constraint) -> float:
    """Largest of ``amounts`` in tolerances, as a length [m equivalent]."""
    return METRE_TOLERANCE * float(amounts.max()) / constraint.tolerance
