"""Drones look where their trajectory says, from its first point to its last."""

import dataclasses

import numpy as np
import pytest

from deploy.flightlog.reader import read_log
from deploy.phases import Phase
from deploy.radio.simulated.physics.algebra import heading
from missions.schema import PathYaw, TrajectorySettings
from planner.trajectory.encode import decode, encode
from planner.trajectory.piecewise import PiecewisePolynomial
from tests.deploy.flight_bench import DURATION, SMOOTH, certified, fly_on, small_mission, small_plan, stage

FIRST, TURN = 0.5, 1.2  # [rad]


def turning(encoded):
    """The same way, looking from 0.5 rad to 1.7 rad on it."""
    trajectory = decode(encoded)
    coefficients = trajectory.coefficients.copy()
    coefficients[0, 3] = TURN * SMOOTH * DURATION ** -np.arange(8.0)
    coefficients[0, 3, 0] += FIRST
    return encode(PiecewisePolynomial(trajectory.durations, coefficients))


@pytest.mark.parametrize("controller", ["mellinger", "pid"])
def test_the_heading_follows(tmp_path, controller):
    # The default PID lags behind on the way by more than the small flight's tracking limit allows; headings do not.
    mission = small_mission(controller=controller, tracking_limit=1.0)
    mission = dataclasses.replace(mission, trajectory=TrajectorySettings(yaw=PathYaw()))
    plan = certified(mission, {name: turning(encoded) for name, encoded in small_plan(mission).trajectories.items()})
    with stage(tmp_path, plan) as ready:
        truth = []
        ready.world.every(0.05, lambda t: truth.append(heading(ready.world.bodies.rotation)))
        outcome = fly_on(ready, plan)
        path = ready.log.path
    assert outcome.phase is Phase.LANDED, outcome
    assert np.max(truth) == pytest.approx(FIRST + TURN, abs=0.1)
    assert np.min(truth) > -0.1  # never the other way round

    record = read_log(path)
    begin = next(event.t for event in record.events if event.name == "mission_start")
    for name, encoded in plan.trajectories.items():
        estimate = record.series[f"/{name}/estimate"]
        during = (estimate.t > begin) & (estimate.t < begin + DURATION)
        asked = decode(encoded).evaluate(estimate.t[during] - begin)[:, 3]
        assert during.sum() > 20
        assert asked[0] == pytest.approx(FIRST, abs=0.05)
        assert np.abs(estimate["attitude"][during, 2] - asked).max() < 0.25  # 0.2 s behind with PID


def test_who_starts_above_his_pad_turns_before_the_search_begins(tmp_path):
    """No move takes him there, so nothing else would turn him: he would begin the search with a jerk."""
    mission = small_mission()
    over_pads = tuple(dataclasses.replace(robot, pad=None) for robot in mission.robots)
    mission = dataclasses.replace(mission, robots=over_pads, trajectory=TrajectorySettings(yaw=PathYaw()))
    plan = certified(mission, {name: turning(encoded) for name, encoded in small_plan(mission).trajectories.items()})
    assert not any(plan.transfers.approach.values())
    with stage(tmp_path, plan) as ready:
        outcome = fly_on(ready, plan)
        path = ready.log.path
    assert outcome.phase is Phase.LANDED, outcome
    record = read_log(path)
    begin = next(event.t for event in record.events if event.name == "mission_start")
    for name in plan.trajectories:
        estimate = record.series[f"/{name}/estimate"]
        before = np.searchsorted(estimate.t, begin) - 1
        assert estimate["attitude"][before, 2] == pytest.approx(FIRST, abs=0.05)
