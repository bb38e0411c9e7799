"""One search: its clock, its best motion, its history.

Random starts race on coarse time grids, or where those have steps as long looking at samples only, and the winner is
refined on the problem's own grid.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from missions.schema import SolverSettings
from planner.models import has_mass
from planner.plan import Plan
from planner.problem import Problem
from planner.solver import augmented_lagrangian as al
from planner.solver.coarse import carried_controls, refined_controls, refined_multipliers
from planner.solver.gauss_newton import GaussNewton
from planner.solver.lagrangian import Lagrangian
from planner.solver.lanes import Runner
from planner.solver.lbfgs import Memory
from planner.solver.misses import METRE_TOLERANCE, violations
from planner.solver.race import FEW, MANY, Race, laps, leaders, start
from planner.solver.result import Progress, SolveOutcome, SolveStatus
from planner.solver.scaling import scaled_modes

REPAIR_SECONDS = 2.0  # wall time a search that was cut short may take to make its most promising motion feasible
REPAIR_PENALTY, REPAIR_GROWTH = 30.0, 1.3  # stiff from the start: what counts is to meet the limits, soon
REST_PENALTY = 1.0  # μ of a search from rest: softer ones tear the swarm apart, stiffer ones leave it where it is
RIPE = 5.0  # tolerances of violation at which a coarse search has said what it can


@dataclass
class Best:
    """The best motion so far: met limits first, then met preferences, then low E."""

    key: tuple[float, float, float]
    state: al.State


@dataclass
class Search:
    """Searches one problem.

    Attributes:
        problem: what to solve. settings: seed, time limit. schedule: pace.
        progress: called after every round. should_stop: asked before every iteration.
        stream: which of the seed's streams of random numbers to draw starts from.
        best: so far. history: one entry a round. interrupted: whether ``should_stop`` said so.
    """

    problem: Problem
    settings: SolverSettings
    schedule: al.Schedule
    progress: Callable[[Progress], None] | None = None
    should_stop: Callable[[], bool] | None = None
    stream: int = 0
    best: Best | None = None
    history: list[Progress] = field(default_factory=list)
    interrupted: bool = False

    def __post_init__(self) -> None:
        self.cpu_start, self.wall_start = time.process_time(), time.monotonic()
        self.lagrangian = self.formulate(self.problem)
        self.model = GaussNewton.of(self.lagrangian)
        self.rng = np.random.default_rng([self.settings.seed, self.stream])
        self.spent = 0  # evaluations by other formulations: on the coarse grid, or before the search began afresh

    @staticmethod
    def formulate(problem: Problem) -> Lagrangian:
        """A problem with preferences in force."""
        return Lagrangian(problem, scaled_modes(problem), (*problem.constraints, *problem.preferences))

    def pace(self, state: al.State) -> al.Schedule:
        """Of a search on its own: where most of the curvature is known, rounds are longer and fewer."""
        return self.schedule.informed if self._informed(state) else self.schedule

    def _informed(self, state: al.State) -> bool:
        return self.model is not None and self.model.covers(state.multipliers)

    def step(self, state: al.State, memory: Memory) -> al.State:
        """One round of a search on its own."""
        model = self.model if self._informed(state) else None
        return al.step(self.lagrangian, state, self.pace(state), memory, self.keep_going, model)

    def warm(self, initial: Plan) -> Runner:
        """State of a plan given, on this grid or a coarser one."""
        u = initial.u if len(initial.u) == self.problem.steps else refined_controls(initial.u, self.problem.steps)
        z = self.lagrangian.modes.variables(u).ravel()
        return Runner(al.init(self.lagrangian, z, self.schedule), Memory(self.schedule.memory))

    def cold(self) -> Runner:
        """State of the winner of a race, on the problem's own grid."""
        runner = self.race()
        coarse = self.lagrangian
        if coarse.problem is self.problem:
            return runner
        if has_mass(self.problem.dynamics):
            self.schedule = self.schedule.hurried
        state, memory, _ = runner
        while self.keep_going() and not self.ripe(state):
            state = self.step(state, memory)
            self.tell(state, f"coarse round {state.round}")
        self.on(self.problem)
        return self.moved(Runner(state, memory))

    def race(self) -> Runner:
        """The best of random starts, on the finest of the grids that races are run on."""
        course = laps(self.problem)
        count = self.settings.starts or (MANY if course[0].grid.steps < self.problem.steps else FEW)
        runners: list[Runner] = []
        for grid, heats in course:
            self.on(grid)
            if runners:
                leading = leaders(runners, max(1, round(heats[0].share * count)))
                runners = [self.moved(runner) for runner in leading]
            else:
                runners = [start(self.lagrangian, self.schedule, self.rng) for _ in range(count)]
            heat = Race(self.lagrangian, self.schedule, self.keep_going, self.tell_of, self.record)
            runners = heat.run(heats, runners, count)
        return leaders(runners, 1)[0]

    def on(self, problem: Problem) -> None:
        """Go on with a formulation of ``problem``: this one's, on another grid; or afresh."""
        self.spent = self.evaluations
        self.lagrangian = self.formulate(problem)
        self.model = GaussNewton.of(self.lagrangian, None if self.model is None else self.model.damping)

    def at_rest(self) -> Runner | None:
        """Robots that stay where they start, if they may: who has to stay together for ever is better off so.

        Random first guesses tear such swarms apart, and they do not find back through one another.
        """
        self.on(self.problem)
        lagrangian, schedule = self.lagrangian, replace(self.schedule, penalty=REST_PENALTY)
        z = lagrangian.modes.variables(np.zeros(self.problem.dynamics.controls_shape)).ravel()
        lagrangian.adapt(lagrangian.motion(z))
        state = al.init(lagrangian, z, schedule)
        violation, preference = al.misses(lagrangian, lagrangian.at(z))
        if violation > METRE_TOLERANCE:
            return None
        state = replace(state, violation=violation, preference=preference)
        self.record(state, "at rest")
        return Runner(state, Memory(schedule.memory))

    def ripe(self, state: al.State) -> bool:
        """Whether the coarse grid has said what it can."""
        near = max(state.violation, state.preference) <= RIPE * METRE_TOLERANCE
        return near or al.terminate(state, self.pace(state))

    def moved(self, runner: Runner) -> Runner:
        """A runner from a coarser grid, or a simpler model, on this one."""
        lagrangian, state = self.lagrangian, runner.state
        u = carried_controls(state.motion, lagrangian.problem.dynamics)
        fresh = al.init(lagrangian, lagrangian.modes.variables(u).ravel(), self.schedule)
        multipliers = tuple(
            refined_multipliers(lam, zero.shape) for lam, zero in zip(state.multipliers, fresh.multipliers, strict=True)
        )
        fresh = replace(fresh, multipliers=multipliers, mu=state.mu, round=state.round)
        return Runner(fresh, Memory(self.schedule.memory), runner.merit)

    def rounds(self, runner: Runner) -> al.State:
        """Rounds until done, interrupted or out of time."""
        state, memory, _ = runner
        while self.keep_going() and not al.terminate(state, self.pace(state)):
            state = self.step(state, memory)
            self.record(state, f"round {state.round}")
        return state

    def repair(self, state: al.State) -> al.State:
        """A short push towards the limits of a motion that was cut short; ends as soon as they are met."""
        schedule = replace(self.schedule, growth=REPAIR_GROWTH).steady
        in_force = state.multipliers[: len(self.lagrangian.constraints)]  # the best may be from before preferences went
        state = replace(state, multipliers=in_force, mu=max(state.mu, REPAIR_PENALTY))
        memory = Memory(schedule.memory)
        deadline = time.monotonic() + REPAIR_SECONDS

        def in_time() -> bool:
            return time.monotonic() < deadline

        while in_time() and not self.feasible and state.round < schedule.rounds:
            state = al.step(self.lagrangian, state, schedule, memory, in_time)
            self.record(state, f"stopping, repair round {state.round}")
        return state

    def without_preferences(self, guess: al.State) -> Runner:
        """Once more from ``guess``, asking only for what is required: preferences may be what stands in the way."""
        self.lagrangian.constraints = self.problem.constraints
        return Runner(al.init(self.lagrangian, guess.z, self.schedule), Memory(self.schedule.memory))

    @property
    def feasible(self) -> bool:
        """Whether the best motion so far meets every limit."""
        return self.best is not None and self.best.state.violation <= METRE_TOLERANCE

    def keep_going(self) -> bool:
        """Whether there is time left and nobody interrupted."""
        if self.should_stop is not None and self.should_stop():
            self.interrupted = True
        return not self.interrupted and not self.out_of_time

    @property
    def out_of_time(self) -> bool:
        """Whether the time limit (wall time: it is a person who waits) has passed."""
        return time.monotonic() - self.wall_start > self.settings.time_limit

    def record(self, state: al.State, phase: str) -> None:
        """Keep the best on the problem's own grid, tell the world."""
        key = (
            max(state.violation, METRE_TOLERANCE),
            max(state.preference, METRE_TOLERANCE),
            state.E,
        )
        if self.lagrangian.problem is self.problem and (self.best is None or key < self.best.key):
            self.best = Best(key, state)
        self.tell(state, phase)

    def tell(self, state: al.State, phase: str) -> None:
        """One entry of history and progress."""
        self.tell_of(state.E, state.violation, phase)

    def tell_of(self, E: float, violation: float, phase: str, more: int = 0) -> None:
        """The same, while ``more`` evaluations are under way that are not counted yet."""
        entry = Progress(
            E=E,
            violation_m=max(violation, 0.0),
            seconds=time.process_time() - self.cpu_start,
            evaluations=self.evaluations + more,
            phase=phase,
        )
        self.history.append(entry)
        if self.progress is not None:
            self.progress(entry)

    @property
    def evaluations(self) -> int:
        """Of objective, constraints and gradient, on both grids."""
        return self.spent + self.lagrangian.evaluations

    def finish(self, last: al.State) -> SolveOutcome:
        """Outcome of the best motion seen."""
        best = self.best.state if self.best is not None else last
        feasible = best.violation <= METRE_TOLERANCE
        status = self._status(feasible, al.settled(last, self.pace(last)))
        if feasible:
            return SolveOutcome(self._plan(best), status, (), tuple(self.history))
        missed = violations(self.problem.constraints, best.motion)
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
            evaluations=self.evaluations,
            seconds=time.process_time() - self.cpu_start,
        )


def search_cold(search: Search) -> SolveOutcome:
    """A search from random starts, to its end; once more if it ends without a plan while there may be one."""
    last = _settled(search, search.cold())
    if not search.feasible and search.keep_going():
        rest = search.at_rest()
        if rest is not None:
            last = _settled(search, rest)
        elif not al.hopeless(last, search.pace(last)):
            last = _settled(search, search.cold())
    return _ended(search, last)


def search_warm(search: Search, initial: Plan) -> SolveOutcome:
    """A search from a plan given, to its end."""
    return _ended(search, _settled(search, search.warm(initial)))


def _settled(search: Search, runner: Runner) -> al.State:
    """Rounds until done, without preferences if they are in the way."""
    last = search.rounds(runner)
    if search.problem.preferences and not search.feasible and search.keep_going():
        last = search.rounds(search.without_preferences(runner.state))
    return last


def _ended(search: Search, last: al.State) -> SolveOutcome:
    """The outcome, after a last push if there is no plan and no time."""
    if not search.feasible and not search.keep_going():
        last = search.repair(search.best.state if search.best is not None else last)
    return search.finish(last)
