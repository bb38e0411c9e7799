"""How to fly: the offline planner. Pure: no hardware, no files, no printing, no global state.

As a library, from a mission to a plan that is certified as the bytes that fly::

    import numpy as np
    from missions import load_mission
    from planner import build_problem, make_flight_plan, solve

    mission = load_mission("missions/one_drone.yaml")
    problem = build_problem(mission)          # frozen: dynamics, metric, constraints
    outcome = solve(problem, mission.solver)  # outcome.plan is None unless every limit is met
    plan = outcome.plan
    print(outcome.status.value, plan.ergodicity)
    print(plan.t.shape, plan.q.shape, plan.u.shape)  # (T+1,) [s], (T+1, N, ν) [m], (T, N, ν) [m/s²]
    print(np.linalg.norm(plan.v, axis=-1).max())     # [m/s]

    flight = make_flight_plan(mission)        # the same, then polynomials, bytes, certificate
    assert flight.certificate.passed
    bytes_of = {name: t.size for name, t in flight.trajectories.items()}

Names are imported when they are first used, so that importing the package costs nothing. NumPy's thread count is the
caller's: the planner sets none.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from planner.certificate.certify import certify
    from planner.errors import PlannerError
    from planner.indicators import indicators
    from planner.pipeline import make_flight_plan
    from planner.plan import Plan
    from planner.problem import Problem, build_problem
    from planner.solver.methods import solve
    from planner.study import run_study
    from planner.trajectory.fit import fit

_HOMES = {
    "Plan": "planner.plan",
    "PlannerError": "planner.errors",
    "Problem": "planner.problem",
    "build_problem": "planner.problem",
    "certify": "planner.certificate.certify",
    "fit": "planner.trajectory.fit",
    "indicators": "planner.indicators",
    "make_flight_plan": "planner.pipeline",
    "run_study": "planner.study",
    "solve": "planner.solver.methods",
}

__all__ = [
    "Plan",
    "PlannerError",
    "Problem",
    "build_problem",
    "certify",
    "fit",
    "indicators",
    "make_flight_plan",
    "run_study",
    "solve",
]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - whatever the name stands for
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'planner' has no attribute {name!r}; known: {', '.join(__all__)}")
