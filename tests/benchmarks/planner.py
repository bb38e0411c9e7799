"""The planner's rows: CPU seconds, E, worst violation, meetings, certified bytes; evaluation cost by robots."""

from __future__ import annotations

import math
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import missions
from missions.connectivity import ProbabilisticConnectivity
from missions.loader import load_mission
from missions.schema import (
    Gaussian,
    GaussianMixtureMap,
    Horizon,
    Limits,
    Mission,
    NoConnectivity,
    Workspace,
)
from planner.errors import PlannerError
from planner.pipeline import make_flight_plan
from planner.problem import build_problem
from planner.solver.search import Search
from planner.solver.solve import solve
from tests.planner.problems import NOTEBOOK_MEANS, imec, robots, scaling

FIFTY = Path(missions.__file__).parent / "examples" / "fifty_robots.yaml"
COLD = "from missions.loader import load_mission; from planner.pipeline import make_flight_plan; {}"


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes:
        problem, authors, ask: what it is, what the authors' code reached, what issue 3 asks.
        seconds, ergodicity, violation, met: of the solver's plan.
        certified: bytes of the robot that has the most, or why there are none.
        certifying: CPU seconds from the solver's plan to certified bytes: fits, refined plans, certificates.
    """

    problem: str
    authors: str
    ask: str
    seconds: float
    ergodicity: float
    violation: float
    met: str
    certified: str
    certifying: float

    def __str__(self) -> str:
        return (
            f"{self.problem:38s} | {self.authors:24s} | {self.ask:18s} | {self.seconds:6.2f} | "
            f"{self.ergodicity:9.2e} | {self.violation:9.5f} | {self.met:3s} | {self.certified:9s} | "
            f"{self.certifying:6.2f}"
        )


HEADER = (
    f"{'problem':38s} | {'authors: CPU s, E':24s} | {'ask: CPU s, E':18s} | {'CPU s':6s} | "
    f"{'E':9s} | {'worst [m]':9s} | met | certified | + CPU s"
)


def problems() -> list[tuple[str, Callable[[], Mission], str, str]]:
    """Name, mission, what the authors' code reached, what issue 3 asks."""
    return [
        ("notebook case, 4 robots, 300 steps", imec, "500, 2.0e-3, missed 4 mm", "5, 2.5e-4"),
        ("one robot, 300 steps", lambda: imec(robots=robots((0.5, 0.3)), connectivity=NoConnectivity()), "", ""),
        ("VII-G, N = 5, 100 steps", lambda: scaling(5), "217, 9.8e-2", "2, 1e-6"),
        ("VII-G, N = 10, 100 steps", lambda: scaling(10), "none after 676", "8, 4e-4"),
        (
            "N = 5 stretched, 3 sub-periods",
            lambda: scaling(5, sub_periods=3, stretched=True),
            "none after 720",
            "5, 1e-3",
        ),
        ("50 robots, ring and connected graph", lambda: load_mission(FIFTY), "", "60, feasible"),
    ]


def fleet(count: int) -> Mission:
    """Robots on a grid in a box whose area grows with their number, 20 × 20 m for 50; R_c 2 m, a ring of pairs.

    Neighbours in the ring start as neighbours on a grid walked in a snake.
    """
    side = 20.0 * (count / 50.0) ** 0.5
    means = [(x * side / 3.0, y * side / 2.5) for x, y in NOTEBOOK_MEANS]
    columns = int(np.ceil(count**0.5))
    pitch = side / (columns + 1)
    cells = [
        (row, column if row % 2 == 0 else columns - 1 - column) for row in range(columns) for column in range(columns)
    ]
    return scaling(
        count,
        workspace=Workspace((0.0, 0.0), (side, side)),
        information=GaussianMixtureMap(tuple(Gaussian(mean, 0.01 * side**2, 0.25) for mean in means)),
        horizon=Horizon(100.0, 1.0),
        robots=robots(*((pitch * (1 + x), pitch * (1 + y)) for x, y in cells[:count])),
        limits=Limits(0.5, 10.0, 0.3),
        connectivity=ProbabilisticConnectivity(range=2.0, sub_periods=1, threshold=0.2, pairs="ring"),
    )


def measure(name: str, mission: Mission, authors: str, ask: str, seed: int) -> Row:
    """Solve one problem, then take it to certified bytes; met says whether the pairs the mission asks to meet do."""
    settings = replace(mission.solver, seed=seed, time_limit=600.0)
    start = time.process_time()
    problem = build_problem(mission)
    outcome = solve(problem, settings)
    seconds = time.process_time() - start
    if outcome.plan is None:
        last = outcome.history[-1]
        return Row(name, authors, ask, seconds, last.E, last.violation_m, f"no: {outcome.violations[0]}", "no", 0.0)
    plan = outcome.plan
    motion = problem.dynamics.rollout(plan.u)
    met = all(float(c.violation(motion).max()) <= c.tolerance for c in problem.preferences)
    start = time.process_time()
    try:
        flight_plan = make_flight_plan(replace(mission, solver=settings))
        certified = f"{max(encoded.size for encoded in flight_plan.trajectories.values())} B"
    except PlannerError as error:
        certified = f"no: {error}"
    certifying = time.process_time() - start - seconds  # the same search comes first
    met_all = "yes" if met else "no"
    return Row(name, authors, ask, seconds, plan.ergodicity, plan.violation, met_all, certified, max(certifying, 0.0))


def evaluation_cost(mission: Mission) -> float:
    """CPU seconds of one evaluation of objective, constraints and gradient."""
    lagrangian = Search.formulate(build_problem(mission))
    count = len(mission.robots)
    z = 0.3 * np.random.default_rng(0).standard_normal(lagrangian.modes.S.shape[1] * count * 2)
    multipliers = [np.zeros_like(g) for g in lagrangian.at(z).residuals]
    lagrangian(z, multipliers, 1.0)
    costs = []
    for _ in range(7):
        start = time.process_time()
        lagrangian(z.copy(), multipliers, 1.0)  # a copy: the same z again would cost nothing
        costs.append(time.process_time() - start)
    return statistics.median(costs)


def scaling_table() -> None:
    """Cost of an evaluation from 10 to 100 robots with ring pairs, and the exponent."""
    print("\none evaluation of objective, constraints and gradient, ring pairs, 100 steps (ask: N^1.3 at most):")
    counts = (10, 20, 50, 100)
    costs = [evaluation_cost(fleet(count)) for count in counts]
    for count, cost in zip(counts, costs, strict=True):
        print(f"  {count:3d} robots {1e3 * cost:8.2f} ms", flush=True)
    print(f"  growth from 10 to 100: N^{np.log10(costs[-1] / costs[0]):.2f}")


def cold_start() -> None:
    """What a fresh process spends before its first plan, and on it."""
    print("\na fresh process (ask: one_drone.yaml within 3 s):")
    plan = "make_flight_plan(load_mission('missions/one_drone.yaml'))"
    for label, code in (
        ("imports", COLD.format("")),
        ("imports and plan of missions/one_drone.yaml", COLD.format(plan)),
    ):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-c", code], check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        print(
            f"  {label:44s} {after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime:6.2f} CPU s",
            flush=True,
        )


def run(seeds: int) -> None:
    """Print the tables."""
    print(HEADER)
    for name, mission, authors, ask in problems():
        rows = [measure(name, mission(), authors, ask, seed) for seed in range(seeds)]
        for seed, row in enumerate(rows if len(rows) > 1 else []):
            print(
                f"  seed {seed}: {row.seconds:.2f} s, E {row.ergodicity:.2e}, {row.violation:.5f} m, {row.met}, "
                f"certified {row.certified} after {row.certifying:.2f} s more",
                flush=True,
            )
        print(median(rows), flush=True)
    scaling_table()
    cold_start()


def median(rows: list[Row]) -> Row:
    """The row of a problem: medians over seeds, the worst violation of all, most bytes, met and certified if always."""
    return Row(
        rows[0].problem,
        rows[0].authors,
        rows[0].ask,
        statistics.median(row.seconds for row in rows),
        statistics.median(row.ergodicity for row in rows),
        max(row.violation for row in rows),
        next((row.met for row in rows if row.met != "yes"), "yes"),
        max((row.certified for row in rows), key=lambda text: math.inf if text[:2] == "no" else int(text.split()[0])),
        statistics.median(row.certifying for row in rows),
    )
