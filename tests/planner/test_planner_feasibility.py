import dataclasses

import numpy as np
import pytest

from missions.reach import reach
from missions.schema import Limits, ProbabilisticConnectivity
from planner.errors import UnreachableError
from planner.feasibility import check_feasible
from planner.problem import build_problem
from tests.planner.problems import box, imec, robots, scaling, small


@pytest.mark.parametrize("mission", [imec(), small(), box(), scaling(10)], ids=lambda m: m.name)
def test_possible_missions_pass(mission):
    check_feasible(mission)


@pytest.mark.parametrize(
    ("starts", "constraint", "where"),
    [
        (((0.5, 0.3), (0.6, 0.3)), "separation", "r0-r1"),
        (((0.5, 0.3), (1.4, 1.6)), "obstacle clearance", "r1, obstacles[0]"),
        (((0.5, 0.3), (3.1, 1.0)), "workspace", "r1"),
    ],
)
def test_impossible_starts_are_named(starts, constraint, where):
    with pytest.raises(UnreachableError) as caught:
        check_feasible(imec(robots=robots(*starts)))
    assert (caught.value.constraint, caught.value.where) == (constraint, where)


def test_robots_that_cannot_meet_in_time_are_named_with_bound_and_threshold():
    far = small(
        ProbabilisticConnectivity(range=0.1, sub_periods=4, threshold=0.5),
        robots=robots((-0.9, -0.9), (0.9, 0.9)),
    )
    with pytest.raises(UnreachableError, match=r"connection \(r0-r1, sub-period 1\): at best .* required 0.5"):
        check_feasible(far)


@pytest.mark.parametrize("steps", [80, 800, 1301])
def test_the_bound_holds_for_robots_that_race_towards_each_other(steps):
    """However the table of times is thinned, no reachable motion exceeds the bound."""
    duration = 8.0
    base = small(robots=robots((-0.9, 0.9), (0.9, 0.9)), obstacles=())
    dt = duration / steps
    t = np.arange(steps) * dt
    distance = np.minimum(0.5 * 0.5 * t**2, 0.9 - 0.15)  # along x alone: |u| ≤ 0.5 on that axis
    apart = np.maximum(1.8 - distance[:, None] - distance[None, :], 0.0)
    reached = float(np.exp(-(apart**2) / (2 * 0.3**2)).mean())
    policy = ProbabilisticConnectivity(range=0.3, sub_periods=1, threshold=0.999 * reached)
    check_feasible(dataclasses.replace(base, horizon=dataclasses.replace(base.horizon, dt=dt), connectivity=policy))


def test_reach_accelerates_then_cruises():
    mission = small(limits=Limits(0.5, 1.0, 0.3))
    t = np.linspace(0.0, 8.0, 8001)
    r = reach(mission, t)
    speed = np.gradient(r, t)
    assert r[0] == 0.0
    assert speed.max() == pytest.approx(1.0, abs=1e-9)
    assert np.gradient(speed, t).max() == pytest.approx(0.5 * np.sqrt(2), rel=1e-3)


def test_margins_leave_the_starts_feasible():
    touching = imec(robots=robots((0.5, 0.0), (0.8, 0.0), (1.3, 1.2)))  # at the separation, the wall, the obstacle
    problem = build_problem(touching)
    still = problem.dynamics.rollout(np.zeros(problem.dynamics.controls_shape))
    for constraint in problem.constraints:
        if constraint.name != "connection":
            assert constraint.violation(still).max() <= 1e-12, constraint.name
