"""``python -m tests.benchmarks.surface``: four robots around a statue, two around a chair, to certified bytes.

The issue asks for four robots round an object in 60 CPU s.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import missions
from missions.loader import load_mission
from missions.schema import Mission
from planner.pipeline import make_flight_plan
from planner.surface.mission import surface_metric
from planner.surface.seen import seen_surface

EXAMPLES = Path(missions.__file__).parent / "examples"


def run() -> None:
    """Print the rows."""
    print("around an object | read, CPU s | looks, CPU s | viewpoints × points | plan, CPU s (ask: 60) | E | seen")
    for name in ("inspect_four", "inspect_chair"):
        read, mission = _timed(lambda name=name: load_mission(EXAMPLES / f"{name}.yaml"))
        looked, metric = _timed(lambda mission=mission: surface_metric(mission))
        mission = replace(mission, solver=replace(mission.solver, time_limit=600.0))
        planned, plan = _timed(lambda mission=mission: make_flight_plan(mission))  # to certified bytes
        seen = seen_surface(mission, plan.plan.q[:-1]).fraction
        E = plan.certificate.indicators.ergodicity
        size = " × ".join(map(str, metric.views[0].density.shape))
        print(f"{_title(mission):32s} | {read:.1f} | {looked:.1f} | {size} | {planned:.1f} | {E:.2e} | {seen:.0%}")


def _title(mission: Mission) -> str:
    return f"{mission.name}, {len(mission.robots)} robots, {mission.horizon.duration:g} s"


def _timed(work):
    start = time.process_time()
    found = work()
    return time.process_time() - start, found


if __name__ == "__main__":
    run()
