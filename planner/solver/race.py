"""The race: random starts side by side, of whom the better ones go on after every heat.

Motions that differ at the start end in different minima, four times apart in E. Who leads early mostly wins: the rank
correlation with the final E is 0.5 after 8 rounds, 0.7 after 16, 0.85 after 28. The first heats, with most of the
starts, are run on the roughest grid there is. The race ends early: to go on from the best of a few with what is known
of the curvature is worth more than to compare them for longer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from planner.problem import Problem
from planner.solver import augmented_lagrangian as al
from planner.solver.lagrangian import Lagrangian
from planner.solver.lanes import Closed, Runner, run_lanes
from planner.solver.lbfgs import Memory
from planner.solver.stack import Stack, stackable

START_SPREAD = 0.3  # standard deviation of the random first guess, in the scaled variables
MANY, FEW = 48, 8  # starts by default, with a coarse grid to race on and without
MOST_LANES, STACKED_SAMPLES = 24, 7200  # starts that share evaluations, and steps of robots in them, at most about


class Heat(NamedTuple):
    """A stage of the race: the share of all starts that runs it, and for how many rounds."""

    share: float
    rounds: int


class Lap(NamedTuple):
    """Heats on one grid."""

    grid: Problem
    heats: tuple[Heat, ...]


HEATS = (Heat(1.0, 4), Heat(0.25, 8))
ROUGH_HEATS = (Heat(1.0, 4), Heat(0.6, 4), Heat(0.3, 8))
COARSE_HEATS = (Heat(0.12, 12),)


def laps(problem: Problem) -> tuple[Lap, ...]:
    """Which heats are run on which of a problem's grids."""
    coarse = problem.coarse
    if coarse is None or coarse.steps == problem.steps:
        return (Lap(coarse or problem, HEATS),)
    if coarse.coarse is None:
        return (Lap(coarse, ROUGH_HEATS + COARSE_HEATS),)
    return Lap(coarse.coarse, ROUGH_HEATS), Lap(coarse, COARSE_HEATS)


def start(lagrangian: Lagrangian, schedule: al.Schedule, rng: np.random.Generator) -> Runner:
    """A random first guess."""
    _, robots, nu = lagrangian.problem.dynamics.controls_shape
    z = START_SPREAD * rng.standard_normal(lagrangian.modes.count * robots * nu)
    return Runner(al.init(lagrangian, z, schedule), Memory(schedule.memory))


def leaders(runners: list[Runner], count: int) -> list[Runner]:
    """The best of a field so far, best first."""
    return sorted(runners, key=lambda runner: runner.merit)[:count]


@dataclass
class Race:
    """Heats on the grid of one formulation.

    Attributes:
        lagrangian: the formulation. schedule: pace.
        keep_going: asked before every evaluation.
        tell: told E, violation, phase and evaluations under way, whenever a lane closes a round.
        record: given every state after a heat, or after a round where the problem cannot be stacked.
    """

    lagrangian: Lagrangian
    schedule: al.Schedule
    keep_going: Callable[[], bool]
    tell: Callable[[float, float, str, int], None]
    record: Callable[[al.State, str], None]
    _stack: Stack | None = field(default=None, init=False)

    def run(self, heats: tuple[Heat, ...], runners: list[Runner], count: int) -> list[Runner]:
        """Those left after some heats, of a race that ``count`` began."""
        for share, rounds in heats:
            runners = leaders(runners, max(1, round(share * count)))
            if len(runners) > 1 and self.keep_going():
                runners = self._heat(runners, rounds)
        return runners

    def _heat(self, runners: list[Runner], rounds: int) -> list[Runner]:
        """Runners after as many rounds; as they were if there was no time for any of them."""
        phase = f"best of {len(runners)} starts"
        if not stackable(self.lagrangian.problem):
            return [self._alone(runner, rounds, phase) for runner in runners]

        def closed(round_: Closed) -> None:
            self.tell(round_.E, round_.worst, phase, round_.evaluations)

        stack = self._stack_for(len(runners))
        ran, evaluations = run_lanes(stack, runners, rounds, self.schedule, self.keep_going, closed)
        self.lagrangian.evaluations += evaluations
        ran = [runner._replace(state=al.measured(self.lagrangian, runner.state)) for runner in ran]
        for runner in ran:
            self.record(runner.state, phase)
        return ran or runners

    def _stack_for(self, runners: int) -> Stack:
        """A stack with a lane for everybody, or for equal parts of them: lanes that run empty cost as much."""
        problem = self.lagrangian.problem
        steps, robots, _ = problem.dynamics.controls_shape
        most = min(max(STACKED_SAMPLES // (steps * robots), 4), MOST_LANES)
        turns = -(-runners // most)
        lanes = -(-runners // turns)
        if self._stack is None or self._stack.swarms != lanes:
            self._stack = Stack(problem, lanes)
        return self._stack

    def _alone(self, runner: Runner, rounds: int, phase: str) -> Runner:
        """A few rounds of one runner whose problem cannot be stacked."""
        state, memory, _ = runner
        for _ in range(rounds):
            if not self.keep_going():
                break
            state = al.step(self.lagrangian, state, self.schedule.steady, memory, self.keep_going)
            self.record(state, phase)
        return Runner(state, memory, al.merit(self.lagrangian, state))
