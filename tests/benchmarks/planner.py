"""The planner's rows: CPU seconds, E, worst violation, meetings; evaluation cost against the number of robots."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from missions.schema import Mission, NoConnectivity, SolverSettings
from planner.indicators import indicators
from planner.problem import build_problem
from planner.solver.lagrangian import Lagrangian
from planner.solver.modes import Weights, control_modes
from planner.solver.solve import solve
from tests.planner.problems import imec, robots, scaling


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    problem: str
    seconds: float
    ergodicity: float
    violation: float
    met: bool
    evaluations: int
    ask: str

    def __str__(self) -> str:
        return (
            f"{self.problem:44s} {self.seconds:7.2f} {self.ergodicity:10.2e} {1e3 * self.violation:8.2f} mm "
            f"{'yes' if self.met else 'no':>4s} {self.evaluations:7d}   {self.ask}"
        )


HEADER = f"{'problem':44s} {'CPU s':>7s} {'E':>10s} {'violation':>11s} {'met':>4s} {'evals':>7s}   asked"


def problems() -> list[tuple[str, Callable[[], Mission], str]]:
    """Name, mission and what issue 3 asks of it."""
    return [
        ("notebook case, 4 robots, 300 steps", imec, "E 2.5e-4 in 5 s (authors 2.0e-3 in 500 s)"),
        ("one robot, 300 steps", lambda: imec(robots=robots((0.5, 0.3)), connectivity=NoConnectivity()), ""),
        ("VII-G, N = 5, 100 steps", lambda: scaling(5), "E 1e-6 in 2 s (authors 9.8e-2 in 217 s)"),
        ("VII-G, N = 10, 100 steps", lambda: scaling(10), "E 4e-4 in 8 s (authors: none in 676 s)"),
        (
            "N = 5 stretched, 3 sub-periods",
            lambda: scaling(5, sub_periods=3, stretched=True),
            "E 1e-3 in 5 s (authors: none in 720 s)",
        ),
    ]


def measure(name: str, mission: Mission, ask: str, seed: int) -> Row:
    """Solve one problem."""
    start = time.process_time()
    outcome = solve(build_problem(mission), SolverSettings(seed=seed, time_limit=300.0))
    seconds = time.process_time() - start
    if outcome.plan is None:
        last = outcome.history[-1]
        return Row(name, seconds, last.E, last.violation_m, False, last.evaluations, outcome.status.value)
    plan = outcome.plan
    met = indicators(mission, plan.t, plan.q).all_met
    return Row(name, seconds, plan.ergodicity, plan.violation, met, plan.evaluations, ask)


def evaluation_cost(count: int) -> float:
    """CPU seconds of one evaluation of objective, constraints and gradient for ``count`` robots."""
    problem = build_problem(scaling(count))
    modes = control_modes(problem.steps, problem.dt, Weights())
    lagrangian = Lagrangian(problem, modes, (*problem.constraints, *problem.preferences))
    z = 0.3 * np.random.default_rng(0).standard_normal(modes.S.shape[1] * count * 2)
    multipliers = [np.zeros_like(c.evaluate(lagrangian.motion(z)).residual) for c in lagrangian.constraints]
    lagrangian(z, multipliers, 1.0)
    repeats = max(3, 200 // count)
    start = time.process_time()
    for _ in range(repeats):
        lagrangian(z, multipliers, 1.0)
    return (time.process_time() - start) / repeats


def run(seeds: int) -> None:
    """Print the table."""
    print(HEADER)
    for name, mission, ask in problems():
        for seed in range(seeds):
            label = name if seeds == 1 else f"{name}, seed {seed}"
            print(measure(label, mission(), ask, seed), flush=True)
    print("\none evaluation, all pairs, 100 steps:")
    for count in (2, 5, 10):
        print(f"  {count:3d} robots {1e3 * evaluation_cost(count):8.2f} ms", flush=True)
