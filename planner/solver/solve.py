"""Stage 3 of 7: Problem in, Plan out."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from missions.schema import SolverSettings
from planner.constraints.base import Constraint
from planner.dynamics import Motion
from planner.plan import Plan
from planner.problem import Problem
from planner.solver import augmented_lagrangian as al
from planner.solver.lagrangian import Lagrangian
from planner.solver.lbfgs import Memory
from planner.solver.result import Progress, SolveOutcome, SolveStatus, Violation
from planner.solver.scaling import scaled_modes

START_SPREAD = 0.3  # standard deviation of the random first guess, in the scaled variables
WARM_PENALTY = 30.0  # μ a warm start begins with: stiff enough to keep what the given plan has settled


def solve(
    problem: Problem,
    settings: SolverSettings,
    *,
    progress: Callable[[Progress], None] | None = None,
    initial: Plan | None = None,
    should_stop: Callable[[], bool] | None = None,
    schedule: al.Schedule | None = None,
) -> SolveOutcome:
    """Search for the plan of lowest ergodicity that meets every limit.

    Deterministic for a seed, except that ``settings.time_limit`` and ``should_stop`` end it when they do.

    Args:
        problem: what to solve.
        settings: seed, time limit.
        progress: called after every round.
        initial: plan of the same robots and steps to start from.
        should_stop: asked before every iteration; True ends the search with the best plan so far.
        schedule: the augmented Lagrangian's pace; for studies of the solver.

    Returns:
        The outcome; its plan is None unless every limit of the problem is met.
    """
    run = _Run(problem, settings, progress, should_stop)
    schedule = schedule or al.Schedule()
    if initial is not None:
        schedule = replace(schedule, penalty=WARM_PENALTY)
        guess, memory = run.warm(initial, schedule)
    else:
        guess, memory = run.race(schedule)
    last = run.search(guess, memory, schedule)
    if problem.preferences and not run.feasible and run.keep_going():
        last = run.search(*run.without_preferences(guess, schedule), schedule)
    return run.finish(last, schedule)


@dataclass
class _Best:
    """The best motion so far: met limits first, then met preferences, then low E."""

    key: tuple[float, float, float]
    state: al.State


@dataclass
class _Run:
    """One solve: its clock, its best motion, its history."""

    problem: Problem
    settings: SolverSettings
    progress: Callable[[Progress], None] | None
    should_stop: Callable[[], bool] | None
    best: _Best | None = None
    history: list[Progress] = field(default_factory=list)
    interrupted: bool = False

    def __post_init__(self) -> None:
        self.cpu_start, self.wall_start = time.process_time(), time.monotonic()
        problem = self.problem
        modes = scaled_modes(problem)
        self.lagrangian = Lagrangian(problem, modes, (*problem.constraints, *problem.preferences))

    def warm(self, initial: Plan, schedule: al.Schedule) -> tuple[al.State, Memory]:
        """State of a plan given."""
        z = self.lagrangian.modes.variables(initial.u).ravel()
        return al.init(self.lagrangian, z, schedule), Memory(schedule.memory)

    def race(self, schedule: al.Schedule) -> tuple[al.State, Memory]:
        """The best of a few random starts: after every heat the better half goes on, until one is left."""
        modes, (_, robots, nu) = self.lagrangian.modes, self.problem.dynamics.controls_shape
        rng = np.random.default_rng(self.settings.seed)
        guesses = START_SPREAD * rng.standard_normal((schedule.starts, modes.S.shape[1] * robots * nu))
        runners = [(al.init(self.lagrangian, z, schedule), Memory(schedule.memory)) for z in guesses]
        while len(runners) > 1 and self.keep_going():
            runners = [self.heat(*runner, schedule, len(runners)) for runner in runners]
            runners.sort(key=lambda runner: al.merit(self.lagrangian, runner[0]))
            runners = runners[: len(runners) // 2]
        return runners[0]

    def heat(self, state: al.State, memory: Memory, schedule: al.Schedule, field: int) -> tuple[al.State, Memory]:
        """A few rounds of one of ``field`` runners."""
        for _ in range(schedule.heat):
            if not self.keep_going():
                break
            state = al.step(self.lagrangian, state, schedule, memory, self.keep_going)
            self.record(state, f"best of {field} starts")
        return state, memory

    def without_preferences(self, guess: al.State, schedule: al.Schedule) -> tuple[al.State, Memory]:
        """Once more from ``guess``, asking only for what is required: preferences may be what stands in the way."""
        self.lagrangian.constraints = self.problem.constraints
        return al.init(self.lagrangian, guess.z, schedule), Memory(schedule.memory)

    @property
    def feasible(self) -> bool:
        """Whether the best motion so far meets every limit."""
        return self.best is not None and self.best.state.violation <= al.METRE_TOLERANCE

    def keep_going(self) -> bool:
        """Whether there is time left and nobody interrupted."""
        if self.should_stop is not None and self.should_stop():
            self.interrupted = True
        return not self.interrupted and not self.out_of_time

    @property
    def out_of_time(self) -> bool:
        """Whether the time limit (wall time: it is a person who waits) has passed."""
        return time.monotonic() - self.wall_start > self.settings.time_limit

    def search(self, state: al.State, memory: Memory, schedule: al.Schedule) -> al.State:
        """Rounds until done, interrupted or out of time."""
        while self.keep_going() and not al.terminate(state, schedule):
            state = al.step(self.lagrangian, state, schedule, memory, self.keep_going)
            self.record(state, f"round {state.round}")
        return state

    def record(self, state: al.State, phase: str) -> None:
        """Keep the best, tell the world."""
        key = (
            max(state.violation, al.METRE_TOLERANCE),
            max(state.preference, al.METRE_TOLERANCE),
            state.E,
        )
        if self.best is None or key < self.best.key:
            self.best = _Best(key, state)
        entry = Progress(
            E=state.E,
            violation_m=max(state.violation, 0.0),
            seconds=time.process_time() - self.cpu_start,
            evaluations=self.lagrangian.evaluations,
            phase=phase,
        )
        self.history.append(entry)
        if self.progress is not None:
            self.progress(entry)

    def finish(self, last: al.State, schedule: al.Schedule) -> SolveOutcome:
        """Outcome of the best motion seen."""
        best = self.best.state if self.best is not None else last
        feasible = best.violation <= al.METRE_TOLERANCE
        status = self._status(feasible, al.settled(last, schedule))
        if feasible:
            return SolveOutcome(self._plan(best), status, (), tuple(self.history))
        missed = _violations(self.problem.constraints, best.motion)
        return SolveOutcome(None, status, missed, tuple(self.history))

    def _status(self, feasible: bool, settled: bool) -> SolveStatus:
        if self.interrupted:
            return SolveStatus.FEASIBLE_AT_INTERRUPTION if feasible else SolveStatus.INTERRUPTED
        if self.out_of_time:
            return SolveStatus.FEASIBLE_AT_TIME_LIMIT if feasible else SolveStatus.TIME_LIMIT
        if not feasible:
            return SolveStatus.INFEASIBLE
        return SolveStatus.CONVERGED if settled else SolveStatus.FEASIBLE_AT_EFFORT_LIMIT

    def _plan(self, state: al.State) -> Plan:
        motion, problem = state.motion, self.problem
        v = motion.v.copy()
        if problem.dynamics.rests:
            v[-1] = 0.0  # by construction, up to rounding
        return Plan(
            t=np.arange(problem.steps + 1, dtype=np.float64) * problem.dt,
            q=motion.q,
            v=v,
            u=motion.u,
            ergodicity=state.E,
            violation=max(state.violation, 0.0),
            seed=self.settings.seed,
            evaluations=self.lagrangian.evaluations,
            seconds=time.process_time() - self.cpu_start,
        )


def _violations(constraints: tuple[Constraint, ...], motion: Motion) -> tuple[Violation, ...]:
    """The worst miss of each constraint that is missed, largest (in tolerances) first."""
    missed = []
    for constraint in constraints:
        amounts = constraint.violation(motion)
        index = np.unravel_index(int(np.argmax(amounts)), amounts.shape)
        amount = float(amounts[index])
        if amount > constraint.tolerance:
            place = constraint.place(tuple(int(i) for i in index))
            violation = Violation(constraint.name, place.where, amount, constraint.unit, place.time)
            missed.append((amount / constraint.tolerance, violation))
    return tuple(violation for _, violation in sorted(missed, key=lambda item: -item[0]))
