"""What a worker process does: one run. NumPy is imported after the thread counts are set."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from missions.schema import Mission

THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
Result = dict[str, Any]


def one_thread_each() -> None:
    """Unless the user said otherwise, a process uses one thread: there are as many processes as wanted already."""
    for name in THREADS:
        os.environ.setdefault(name, "1")


def measure(tree: Mapping[str, Any], folder: str, stage: str) -> Result:
    """Plan one mission and measure the plan; a mission that cannot be planned is a result, too."""
    import json
    from pathlib import Path

    from missions.errors import MissionError
    from missions.files import read_map_file
    from missions.loader import parse_mission
    from planner.errors import PlannerError

    try:
        # JSON is YAML: the loader checks what a study wrote as it checks what a person wrote.
        mission = parse_mission(json.dumps(tree), path="run", read_file=lambda name: read_map_file(Path(folder), name))
        return _certified(mission) if stage == "certify" else _planned(mission)
    except (MissionError, PlannerError) as error:
        return {"feasible": False, "status": type(error).__name__, "message": str(error)}


def _planned(mission: Mission) -> Result:
    from planner.feasibility import check_feasible
    from planner.problem import build_problem
    from planner.solver.methods import solve

    check_feasible(mission)
    outcome = solve(build_problem(mission), mission.solver)
    last = outcome.history[-1] if outcome.history else None
    result: Result = {
        "feasible": outcome.plan is not None,
        "status": outcome.status.name,
        "message": "; ".join(str(violation) for violation in outcome.violations[:2]),
        "cpu_s": round(last.seconds, 2) if last else 0.0,
        "evaluations": last.evaluations if last else 0,
    }
    if outcome.plan is not None:
        result |= _figures(mission, outcome.plan.t, outcome.plan.q)
        result["violation"] = outcome.plan.violation
    return result


def _certified(mission: Mission) -> Result:
    from planner.pipeline import make_flight_plan

    flight = make_flight_plan(mission)
    found = flight.certificate.indicators
    return {
        "feasible": True,
        "status": "CERTIFIED",
        "message": "",
        "cpu_s": round(flight.plan.seconds, 2),
        "evaluations": flight.plan.evaluations,
        **_columns(found),
        "violation": 0.0,
    }


def _figures(mission: Mission, t: Any, q: Any) -> Result:  # noqa: ANN401 - arrays, without NumPy imported yet
    from planner.indicators import indicators

    return _columns(indicators(mission, t, q))


def _columns(found: Any) -> Result:  # noqa: ANN401 - Indicators, without importing them
    return {
        "ergodicity": found.ergodicity,
        "connection_ratio": found.connected_share,
        "probability": found.probability_mean,
        "probability_worst": found.probability_worst,
        "all_met": found.all_met,
        "separation": found.smallest_separation,
        "clearance": found.smallest_clearance,
    }
