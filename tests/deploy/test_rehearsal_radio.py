"""Rehearsals with an ideal radio, and what every rehearsal's log and report say of what is simulated."""

import re

import pytest

import deploy.radio.simulated as simulated
import deploy.radio.simulated.physics as physics
from deploy.analysis import analyse
from deploy.errors import DeployError
from deploy.flightlog.reader import read_log
from deploy.phases import Phase
from deploy.rehearsal import rehearse
from deploy.report.build import build_report
from deploy.scenario.load import parse_scenario
from tests.deploy.flight_bench import parsed, small_plan, small_text


@pytest.fixture(scope="module")
def plans():
    return {
        radio: small_plan(parsed(small_text(more=f"radio: {{rehearsal: {radio}}}\n")))
        for radio in ("ideal", "modelled")
    }


@pytest.fixture(scope="module")
def logs(plans, tmp_path_factory):
    folder = tmp_path_factory.mktemp("flights")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        flown = {radio: rehearse(plan, log_path=folder / f"{radio}.mcap") for radio, plan in plans.items()}
    assert {outcome.phase for outcome, _ in flown.values()} == {Phase.LANDED}
    return {radio: path for radio, (_, path) in flown.items()}


def entered(path, phase):
    return next(event.t for event in read_log(path).events if event.name == "phase" and event.text == phase.value)


def test_over_an_ideal_radio_connections_and_uploads_take_no_time(logs):
    assert entered(logs["ideal"], Phase.CONNECTED) == pytest.approx(0.01)
    assert 0.5 < entered(logs["modelled"], Phase.CONNECTED) < 3.0
    uploading = {radio: entered(path, Phase.UPLOADED) - entered(path, Phase.CHECKED) for radio, path in logs.items()}
    assert uploading["ideal"] == pytest.approx(0.01)
    assert uploading["modelled"] > 0.1


def test_a_scenario_needs_a_radio_that_can_fail(plans, tmp_path):
    plan = plans["ideal"]
    scenario = parse_scenario("events: [{fault: tumble, at: 1.0}]", path="t.yaml", mission=plan.mission)
    with pytest.raises(DeployError, match=r"ideal \(radio\.rehearsal: modelled\)"):
        rehearse(plan, log_path=tmp_path / "no.mcap", scenario=scenario)


@pytest.mark.parametrize("radio", ["ideal", "modelled"])
def test_the_report_of_a_rehearsal_prints_what_the_model_covers(logs, radio):
    metadata = read_log(logs[radio]).metadata
    assert metadata["radio"] == radio
    page = build_report(analyse(read_log(logs[radio])))
    for table in (simulated.__doc__, physics.__doc__):
        rows = re.findall(r"^(\w.*?)  +\S", table, re.MULTILINE)
        assert len(rows) >= 7
        assert all(row in page for row in rows)
    assert page.count("absent:") >= 8
