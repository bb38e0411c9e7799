"""``python -m tests.benchmarks.footprint``: a plan of one drone with a footprint, beside what it would be without.

The issue asks for 10 s of 0.1 s steps in 5 CPU s, and for a footprint ergodicity below that of the paper's baselines, a
fifth of the better one's on maps with wide and narrow regions.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import missions
from missions.footprint import DiscFootprint, Footprint, PointFootprint
from missions.loader import load_mission
from planner.problem import build_problem
from planner.solver.methods import solve

EXAMPLES = Path(missions.__file__).parent / "examples"
BASELINES: dict[str, Footprint] = {
    "point": PointFootprint(),
    **{f"disc of {radius:g} m": DiscFootprint(radius) for radius in (0.05, 0.15, 0.25)},
}


def run() -> None:
    """Print the rows."""
    mission, quadrotor = (load_mission(EXAMPLES / name) for name in ("footprint_map.yaml", "quadrotor_map.yaml"))
    print("footprint, 10 s of 0.1 s, one drone | CPU s (ask: 5) | evaluations | E")
    rows = {"cone": mission, "cone, the paper's quadrotor": quadrotor}
    rows |= {name: replace(mission, footprint=footprint) for name, footprint in BASELINES.items()}
    for name, row in rows.items():
        start = time.process_time()
        outcome = solve(build_problem(row), replace(row.solver, time_limit=600.0))
        spent = time.process_time() - start
        if outcome.plan is None:
            print(f"{name:35s} | {spent:14.2f} | no plan: {outcome.status.value}")
            continue
        print(f"{name:35s} | {spent:14.2f} | {outcome.plan.evaluations:11d} | {outcome.plan.ergodicity:.2e}")


if __name__ == "__main__":
    run()
