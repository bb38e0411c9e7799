"""What the mission's policies and the operator's words lead to, on the simulated radio."""

import dataclasses

import numpy as np
import pytest

from deploy.flight import abort
from deploy.operator import Interrupts
from deploy.phases import Phase
from missions.safety import Safety
from tests.deploy.flight_bench import PADS, fly_on, small_mission, small_plan, stage

PADS_AT = np.array(list(PADS.values()))


@pytest.fixture
def bench(tmp_path, cache):
    def run(act, **safety):
        """Fly; ``act(ready, operator)`` happens once, a second into the search."""
        plan, operator, done = (
            small_plan(dataclasses.replace(small_mission(), safety=Safety(**safety))),
            Interrupts(),
            [],
        )
        with stage(tmp_path, plan) as ready:
            truth = []
            ready.world.every(0.1, lambda t: truth.append(ready.world.positions))

            def observe(status):
                if status.mission_time >= 1.0 and not done:
                    done.append(act(ready, operator))

            outcome = fly_on(ready, plan, cache, operator=operator, observer=observe)
            assert ready.clock.stalls == 0
            return outcome, ready, np.array(truth)

    return run


def hide(ready, operator):
    ready.mocap.hide({"cf2"})


def on_the_pads(ready):
    return np.abs(ready.world.positions[:, :2] - PADS_AT).max() < 0.1


def test_called_back_everybody_lands_on_his_pad(bench):
    outcome, ready, truth = bench(lambda ready, operator: operator.say("abort"))
    assert outcome.phase is Phase.ABORTED
    assert outcome.reason == "the operator called everybody back"
    assert 0.0 < outcome.reaction <= 0.1
    assert {name: latency.count >= 4 for name, latency in outcome.latencies.items()} == {"cf1": True, "cf2": True}
    assert max(latency.largest for latency in outcome.latencies.values()) <= 0.05
    assert all(outcome.landed.values())
    assert on_the_pads(ready)
    assert np.diff(truth[:, :, 2], axis=0).min() > -0.2
    assert np.linalg.norm(truth[:, 0] - truth[:, 1], axis=1).min() > 0.3


def test_a_hold_is_a_hover_that_ends(bench):
    outcome, ready, truth = bench(lambda ready, operator: operator.say("hold"), hold_time=2.0)
    assert outcome.phase is Phase.ABORTED
    assert all(outcome.landed.values())
    assert not on_the_pads(ready)
    still = np.abs(np.diff(truth[:, 0], axis=0)).max(axis=1) < 0.01
    flying = truth[1:, 0, 2] > 0.5
    assert (still & flying).sum() >= 18  # two seconds of hover


def test_the_policy_of_the_mission_decides_and_who_is_held_can_be_called_back(bench):
    def act(ready, operator):
        ready.mocap.hide({"cf2"})
        ready.world.every(0.5, lambda t: (ready.mocap.hide(set()), operator.say("abort")) if t > 9.0 else None)

    outcome, ready, _ = bench(act, pose="hold", hold_time=30.0)
    assert "no pose for 1.0" in outcome.reason
    assert outcome.reaction <= 0.1
    assert any("the hover is over (return)" in warning for warning in outcome.warnings)
    assert all(outcome.landed.values())
    assert on_the_pads(ready)


def test_who_is_to_land_here_lands_first_and_the_others_fly_home(bench):
    outcome, ready, truth = bench(hide, pose="land_here")
    assert outcome.phase is Phase.ABORTED
    assert all(outcome.landed.values())
    assert any("cf2 first; cf1 wait" in warning for warning in outcome.warnings)
    off = np.abs(ready.world.positions[:, :2] - PADS_AT).max(axis=1)
    assert off[0] < 0.1 < off[1]
    down = [int(np.flatnonzero(truth[:, i, 2] > 0.1)[-1]) for i in (0, 1)]
    assert down[0] > down[1] + 20  # two seconds and more
    assert np.linalg.norm(truth[:, 0] - truth[:, 1], axis=1).min() > 0.3


def test_motors_are_not_stopped_above_another_drone(bench):
    def act(ready, operator):
        ready.mocap.hide({"cf2"})
        patch.setattr(abort, "may_fall", lambda *_: False)

    with pytest.MonkeyPatch.context() as patch:
        outcome, _, truth = bench(act, pose="stop_motors")
    assert all(outcome.landed.values())
    assert any("would fall onto another drone" in fault for fault in outcome.faults)
    assert np.diff(truth[:, :, 2], axis=0).min() > -0.2


def test_motors_that_the_policy_stops_are_those_of_the_one_concerned(bench):
    outcome, ready, truth = bench(hide, pose="stop_motors")
    assert outcome.phase is Phase.ABORTED
    assert any("motors stopped by the mission's policy" in fault for fault in outcome.faults)
    assert outcome.landed["cf1"]
    falls = np.diff(truth[:, :, 2], axis=0).min(axis=0)
    assert falls[0] > -0.2  # landed
    assert falls[1] < -0.2  # fell
    assert not ready.world.motors.any()
