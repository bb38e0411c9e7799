"""What a worker process does: one run. NumPy is imported after the thread counts are set, see :mod:`planner.pool`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from missions.schema import Mission
    from planner.certificate.record import Indicators

Result = dict[str, Any]


def measure(tree: Mapping[str, Any], folder: str, stage: str) -> Result:
    """Plan one mission and measure the plan; a mission that cannot be planned is a result, too."""
    from missions.errors import MissionError
    from planner.errors import PlannerError

    try:
        mission = _mission(tree, folder, checked=stage != "reference")
        return STAGES[stage](mission)
    except (MissionError, PlannerError) as error:
        return {"feasible": False, "status": type(error).__name__, "message": str(error)}


def _mission(tree: Mapping[str, Any], folder: str, *, checked: bool) -> Mission:
    """The mission of a run. JSON is YAML: the loader checks what a study wrote as it checks what a person wrote.

    Unchecked, one that contradicts itself passes: the paper's Table II has a row whose robots start out of range.
    """
    import json
    from pathlib import Path

    from missions.errors import MissionError
    from missions.files import read_map_file
    from missions.information import single_maps
    from missions.loader import parse_mission
    from missions.records import RecordReader
    from missions.schema import ArrayMap, ImageMap, Mission
    from missions.yamltree import parse_yaml

    text = json.dumps(tree)
    try:
        return parse_mission(text, path="run", read_file=lambda name: read_map_file(Path(folder), name))
    except MissionError:
        mission = RecordReader("run").read_record(parse_yaml(text, file="run"), Mission)
        from_files = any(isinstance(item, ImageMap | ArrayMap) for _, item in single_maps(mission.information))
        if checked or from_files:  # maps are read after all checks
            raise
        return mission


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
    elif last:
        result |= {"ergodicity": last.E, "violation": last.violation_m}
    return result


def _reference(mission: Mission) -> Result:
    """No proof of impossibility first: the paper's table has such a row, and what the search ends with is the point."""
    import numpy as np

    from planner.solver.imec.published import run_published

    ending = run_published(mission)
    t = np.arange(mission.steps, dtype=np.float64) * mission.horizon.dt
    return {
        "feasible": ending.settled,
        "status": "CONVERGED" if ending.settled else "NOT_CONVERGED",
        "message": "; ".join(str(violation) for violation in ending.missed[:2]),
        "cpu_s": round(ending.seconds, 2),
        "evaluations": ending.iterations,
        **_figures(mission, t, ending.motion.q[:-1]),
        "violation": ending.violation,
    }


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
        **_columns(found, mission.horizon.duration),
        "violation": 0.0,
    }


def _figures(mission: Mission, t: Any, q: Any) -> Result:  # noqa: ANN401 - arrays, without NumPy imported yet
    from planner.indicators import indicators

    return _columns(indicators(mission, t, q), mission.horizon.duration)


def _columns(found: Indicators, duration: float) -> Result:
    same_time = [P for pair in found.pairs for P in pair.same_time_probability]
    return {
        "ergodicity": found.ergodicity,
        "connection_ratio": found.connected_share,
        "probability": found.probability_mean,
        "probability_worst": found.probability_worst,
        "same_time": sum(same_time) / len(same_time) if same_time else math.nan,
        "all_met": found.all_met,
        "longest_gap": max((_longest_gap(pair.contacts, duration) for pair in found.pairs), default=math.nan),
        "separation": found.smallest_separation,
        "clearance": found.smallest_clearance,
    }


def _longest_gap(contacts: Sequence[tuple[float, float]], duration: float) -> float:
    """Longest time [s] without contact, from (begin, end) of the contacts in order."""
    ends = [0.0, *(end for _, end in contacts)]
    begins = [*(begin for begin, _ in contacts), duration]
    return max(begin - end for begin, end in zip(begins, ends, strict=True))


STAGES = {"plan": _planned, "certify": _certified, "reference": _reference}
