"""The way there and back, flown: everybody lands on the pad he took off from; early, nobody lands on what is below."""

import dataclasses

import numpy as np
import pytest

import missions
from deploy.phases import Phase
from missions.loader import load_mission
from missions.obstacles import CylinderObstacle
from missions.shapes import solid
from planner.pipeline import make_flight_plan
from tests.deploy.flight_bench import At, fly_on, small_mission, small_plan, stage
from tests.planner.judged import judge_bytes

LOW = CylinderObstacle((0.65, 0.75), 0.18, 0.3)  # under the middle of cf1's search


@pytest.mark.slow
def test_everybody_lands_on_his_pad(tmp_path):
    """The shipped mission: starts that are exchanged, a pillar between pads and starts, one above another."""
    mission = load_mission(next(iter(missions.__path__)) + "/examples/round_trip.yaml")
    plan = make_flight_plan(mission)
    judge_bytes(plan)
    assert [robot.start[0] for robot in mission.robots[:3]] == [0.4, 1.5, 2.6], "nobody crosses everybody's way"
    with stage(tmp_path, plan) as ready:
        truth = []
        ready.world.every(0.05, lambda t: truth.append(ready.world.positions))
        outcome = fly_on(ready, plan)
        final = ready.world.positions
    assert outcome.completed, outcome
    assert not outcome.warnings
    off = np.linalg.norm(final[:, :2] - [robot.pad for robot in mission.robots], axis=1)
    assert off.max() < 0.05
    flown = np.array(truth)  # (T, N, 3)
    for obstacle in mission.obstacles:
        assert solid(obstacle).value(np.moveaxis(flown, -1, 0)).min() > 0.0
    apart = np.linalg.norm((flown[:, :, None] - flown[:, None]) * [1.0, 1.0, 0.5], axis=-1)
    assert apart[:, ~np.eye(4, dtype=bool)].min() > 0.25


def low_plan():
    return small_plan(dataclasses.replace(small_mission(), obstacles=(LOW,)))


def test_an_abort_over_an_obstacle_comes_down_beside_it(tmp_path):
    plan = low_plan()
    with stage(tmp_path, plan) as ready:
        outcome = fly_on(ready, plan, operator=At(5.9).bind(ready.clock))
        final = ready.world.positions
    assert outcome.phase is Phase.ABORTED
    assert outcome.reason == "the operator asked to land"
    assert "not straight down: cf1" in outcome.warnings
    assert all(outcome.landed.values())
    clearance = solid(LOW).column().value(final.T)
    assert clearance.min() > 0.0
    assert np.linalg.norm(final[0, :2] - LOW.center) < 0.6, "beside it, not far away"
    assert np.abs(final[:, 2]).max() < 0.02


def test_a_landing_where_the_search_ends_is_still_one(tmp_path):
    plan = small_plan(small_mission(return_to="none"))
    with stage(tmp_path, plan) as ready:
        phases = []
        outcome = fly_on(ready, plan, observer=lambda status: phases.append(status.phase))
        final = ready.world.positions
    assert outcome.completed, outcome
    assert Phase.RETURNING not in phases, "it takes no time"
    assert np.abs(final[:, :2] - [(0.8, 1.0), (1.8, 1.0)]).max() < 0.05
