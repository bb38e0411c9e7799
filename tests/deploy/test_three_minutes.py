"""The shipped mission that no trajectory memory holds: planned, certified, flown in legs, judged."""

from pathlib import Path

import numpy as np
import pytest

import missions
from deploy.analysis.analyse import analyse
from deploy.flightlog.reader import read_log
from deploy.rehearsal import rehearse
from deploy.report.build import build_report
from missions import load_mission
from planner.pipeline import make_flight_plan
from planner.trajectory.encoded import MEMORY_SIZE
from tests.planner.judged import judge_bytes

MISSION = Path(missions.__file__).parent / "examples" / "three_minutes.yaml"


@pytest.mark.slow
@pytest.mark.timeout(900)  # a busy computer takes its time over three minutes
def test_three_minutes_are_flown_through_legs_uploaded_in_flight(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    mission = load_mission(MISSION)
    plan = make_flight_plan(mission)
    assert mission.horizon.duration == 180.0
    judge_bytes(plan)
    assert min(encoded.size for encoded in plan.trajectories.values()) > 3 * MEMORY_SIZE
    assert min(len(encoded.legs) for encoded in plan.trajectories.values()) > 5

    outcome, path = rehearse(plan, log_path=tmp_path / "flight.mcap", seed=1)
    assert outcome.completed, outcome
    assert max(outcome.largest_error.values()) < 0.1
    judged = analyse(read_log(path))
    assert len(judged.switches) == sum(len(encoded.legs) - 1 for encoded in plan.trajectories.values())
    for switch in judged.switches:
        assert abs(switch.late) <= mission.radio.jitter
        assert switch.jump <= switch.bound <= mission.radio.switch_jump
    assert np.mean([item.mean for item in judged.tracking]) < 0.03
    assert judged.window.complete
    assert "Legs uploaded in flight" in build_report(judged)
