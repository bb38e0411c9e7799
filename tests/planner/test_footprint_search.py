"""A search by footprint, from the mission to certified bytes (FEO, Fig. 5 and 6)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import missions
from missions.footprint import PointFootprint
from missions.loader import load_mission
from planner.pipeline import make_flight_plan
from planner.problem import build_problem
from planner.solver.methods import solve


@pytest.fixture(scope="module")
def mission():
    shipped = load_mission(Path(missions.__file__).parent / "examples" / "footprint_map.yaml")
    return replace(shipped, solver=replace(shipped.solver, time_limit=600.0))


@pytest.fixture(scope="module")
def flight(mission):
    return make_flight_plan(mission)


def test_a_height_varying_search_is_certified_and_better_than_a_point(mission, flight):
    assert flight.certificate.passed
    point = solve(build_problem(replace(mission, footprint=PointFootprint())), mission.solver)
    assert point.plan is not None
    assert flight.certificate.indicators.ergodicity < 0.2 * point.plan.ergodicity


def test_it_climbs_over_the_wide_region_and_comes_down_to_the_narrow_ones(mission, flight):
    q = flight.plan.q[:-1, 0]
    wide, *narrow = [np.array(component.mean) for component in mission.information.components]
    near = [np.linalg.norm(q[:, :2] - mean, axis=1) < 0.1 for mean in (wide, *narrow)]
    heights = [float(np.median(q[there, 2])) for there in near]
    assert max(heights[1:]) < 0.25 < heights[0]
