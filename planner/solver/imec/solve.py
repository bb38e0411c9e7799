"""Problem in, Plan out, by the paper's Algorithm 1."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from missions.arrays import Array
from missions.schema import SolverSettings
from planner.dynamics import Motion
from planner.plan import Plan
from planner.problem import Problem
from planner.solver.imec import algorithm
from planner.solver.imec.cost import Cost
from planner.solver.imec.parameters import Parameters
from planner.solver.imec.published import first_guess
from planner.solver.misses import violations, worst_miss
from planner.solver.result import Progress, SolveOutcome, SolveStatus

TOLD_EVERY = 10  # iterations between two progress reports


def solve(
    problem: Problem,
    settings: SolverSettings,
    *,
    progress: Callable[[Progress], None] | None = None,
    initial: Plan | None = None,
    should_stop: Callable[[], bool] | None = None,
    parameters: Parameters | None = None,
) -> SolveOutcome:
    """Run Algorithm 1 until its own criterion holds and every limit is met to ``parameters.tolerance``.

    As in the paper there is no end condition: robots end as fast as they happen to be. Preferences do not count.

    Args:
        problem: what to solve.
        settings: time limit, and seed: 0 starts from zero controls as the paper does, others from a slight disturbance
            of them, which shows how much of the outcome is chance.
        progress: called every ten iterations.
        initial: plan of the same robots and steps whose controls to start from.
        should_stop: asked before every iteration.
        parameters: Table I.

    Returns:
        The outcome; its plan is None unless every limit of the problem is met to the tolerance.
    """
    run = _Run(problem, settings, Cost.of(problem, parameters or Parameters()), progress, should_stop)
    guess = first_guess(problem.dynamics.controls_shape, settings.seed) if initial is None else initial.u
    run.search(algorithm.init(run.cost, guess))
    return run.outcome()


@dataclass
class _Best:
    """The best motion so far: limits first, then low E."""

    key: tuple[float, float]
    u: Array
    motion: Motion


@dataclass
class _Run:
    """One solve: its clock, its best motion, its history."""

    problem: Problem
    settings: SolverSettings
    cost: Cost
    progress: Callable[[Progress], None] | None
    should_stop: Callable[[], bool] | None
    best: _Best | None = None
    history: list[Progress] = field(default_factory=list)
    interrupted: bool = False
    settled: bool = False

    def __post_init__(self) -> None:
        self.cpu_start, self.wall_start = time.process_time(), time.monotonic()

    @property
    def tolerance(self) -> float:
        """[m equivalent]."""
        return self.cost.parameters.tolerance

    @property
    def feasible(self) -> bool:
        """Whether the best motion so far meets every limit."""
        return self.best is not None and self.best.key[0] <= self.tolerance

    def search(self, state: algorithm.State) -> None:
        """Iterate until done, out of iterations, interrupted or out of time."""
        self.record(state)
        while state.iteration < self.cost.parameters.iterations and self.keep_going():
            state = algorithm.step(self.cost, state)
            done = algorithm.terminate(self.cost, state)
            if done or state.iteration % TOLD_EVERY == 0 or self.nearly(state):
                self.record(state)
            if done and self.feasible:
                self.settled = True
                break
        self.record(state)

    def nearly(self, state: algorithm.State) -> bool:
        """Whether it is worth looking at the exact violations."""
        return state.violation < self.cost.parameters.violation

    def record(self, state: algorithm.State) -> None:
        """Keep the best, tell the world."""
        motion = self.problem.dynamics.rollout(state.u)  # with what lies between the steps
        E = self.problem.metric.value(motion.q[:-1])
        missed = worst_miss(self.problem.constraints, motion)
        key = (max(missed, self.tolerance), E)
        if self.best is None or key < self.best.key:
            self.best = _Best(key, state.u, motion)
        if self.history and state.iteration % TOLD_EVERY:
            return
        entry = Progress(
            E=E,
            violation_m=max(missed, 0.0),
            seconds=time.process_time() - self.cpu_start,
            evaluations=self.cost.evaluations,
            phase=f"iteration {state.iteration}",
        )
        self.history.append(entry)
        if self.progress is not None:
            self.progress(entry)

    def keep_going(self) -> bool:
        """Whether there is time left and nobody interrupted."""
        if self.should_stop is not None and self.should_stop():
            self.interrupted = True
        return not self.interrupted and not self.out_of_time

    @property
    def out_of_time(self) -> bool:
        """Whether the time limit has passed (wall time: it is a person who waits)."""
        return time.monotonic() - self.wall_start > self.settings.time_limit

    def outcome(self) -> SolveOutcome:
        """Of the best motion seen."""
        best = self.best
        if best is None or not self.feasible:
            missed = violations(self.problem.constraints, best.motion) if best is not None else ()
            return SolveOutcome(None, self._status(), missed, tuple(self.history))
        motion, problem = best.motion, self.problem
        plan = Plan(
            t=np.arange(problem.steps + 1, dtype=np.float64) * problem.dt,
            q=motion.q,
            v=motion.v,
            u=motion.u,
            ergodicity=best.key[1],
            violation=max(worst_miss(problem.constraints, motion), 0.0),
            seed=self.settings.seed,
            evaluations=self.cost.evaluations,
            seconds=time.process_time() - self.cpu_start,
        )
        return SolveOutcome(plan, self._status(), (), tuple(self.history))

    def _status(self) -> SolveStatus:
        if self.interrupted:
            return SolveStatus.FEASIBLE_AT_INTERRUPTION if self.feasible else SolveStatus.INTERRUPTED
        if self.settled:
            return SolveStatus.CONVERGED
        if self.out_of_time:
            return SolveStatus.FEASIBLE_AT_TIME_LIMIT if self.feasible else SolveStatus.TIME_LIMIT
        return SolveStatus.FEASIBLE_AT_EFFORT_LIMIT if self.feasible else SolveStatus.INFEASIBLE
