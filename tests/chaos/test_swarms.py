"""Larger swarms: ten drones on a bad day, and thirty; from the first packet to the last."""

import pytest

from deploy.flightlog.reader import read_log
from deploy.rehearsal import rehearse
from deploy.scenario.load import parse_scenario
from tests.benchmarks.rehearsal import flight_plan

BAD_DAY = """
name: one packet in twenty is lost, and motion capture twice
seed: 5
events:
  - {fault: loss, at: 0.0, rate: 0.05}
  - {fault: mocap_dropout, when: on mission, after: 5.0, duration: 0.5}
  - {fault: mocap_dropout, when: on mission, after: 15.0, duration: 0.7}
"""


def dry_run(count, folder, text=None):
    """So many drones; the outcome and the log."""
    plan = flight_plan(count)
    scenario = None if text is None else parse_scenario(text, path="bad_day.yaml", mission=plan.mission)
    path = folder / "flight.mcap"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        outcome, _ = rehearse(plan, log_path=path, seed=5, scenario=scenario)
    return outcome, read_log(path)


@pytest.mark.chaos
def test_ten_drones_with_losses_and_two_dropouts(tmp_path):
    outcome, log = dry_run(10, tmp_path, BAD_DAY)
    assert outcome.completed, outcome
    assert sum(event.name == "scenario" for event in log.events) == 5
    assert max(outcome.largest_error.values()) < 0.05


@pytest.mark.chaos
def test_thirty_drones(tmp_path):
    outcome, _ = dry_run(30, tmp_path)
    assert outcome.completed, outcome
    assert max(outcome.largest_error.values()) < 0.05
