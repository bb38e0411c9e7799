"""Scenario files: what may be in one, and what every fault does to a flight, as a lab would see it."""

import dataclasses
import functools
from html import escape
from pathlib import Path

import numpy as np
import pytest

import deploy
import missions
from deploy.analysis.analyse import analyse
from deploy.cli.__main__ import main
from deploy.errors import DeployError
from deploy.flightlog.reader import read_log
from deploy.phases import Phase
from deploy.rehearsal import rehearse
from deploy.report import build_report
from deploy.scenario.killed import HostDied
from deploy.scenario.load import load_scenario, parse_scenario, targets
from deploy.scenario.records import HAPPENINGS, Fault
from missions.errors import MissionError
from missions.loader import load_mission
from tests.deploy.flight_bench import parsed, small_plan, small_text

SHIPPED = Path(missions.__file__).parent / "scenarios"
NAMES = sorted(path.stem for path in SHIPPED.glob("*.yaml"))
MISSION = parsed(small_text())


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Flies the small mission with a scenario, once; returns the outcome or what was raised, and the log."""
    folder = tmp_path_factory.mktemp("flights")
    plan = small_plan(MISSION)

    @functools.cache
    def fly(name, turn=0):
        scenario = load_scenario(SHIPPED / f"{name}.yaml", MISSION)
        path = folder / f"{name}-{turn}.mcap"
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("XDG_CACHE_HOME", str(folder))
            try:
                outcome, path = rehearse(plan, log_path=path, seed=scenario.seed, scenario=scenario)
            except DeployError as error:
                outcome, path = error, path.with_name(path.name + ".part")
        return outcome, read_log(path)

    return fly


def happened(log, name):
    return [event for event in log.events if event.name == name]


def said(log, text):
    return [event for event in log.events if text in event.text]


# ---------------------------------------------------------------------------------------------------- effects


def test_losses_show_in_quality_and_latency_and_nobody_has_to_land(flown):
    outcome, log = flown("loss")
    assert outcome.completed, outcome
    (first, over, *_) = happened(log, "scenario")
    assert over.t - first.t == pytest.approx(1.0, abs=0.011)
    for robot in ("cf1", "cf2"):
        link = log.series[f"/{robot}/link"]
        before, after = link.t <= first.t, link.t > first.t
        assert link["quality"][before].min() > 99.0
        assert link["quality"][after].min() < 98.0
        assert np.nanmax(link["latency_ms"][after]) > np.nanmax(link["latency_ms"][before])


def test_the_same_scenario_is_the_same_flight(flown):
    _, first = flown("loss")
    _, again = flown("loss", turn=1)
    first_events, again_events = ([e for e in log.events if not e.text.startswith("disk:")] for log in (first, again))
    assert first_events == again_events
    assert first.series.keys() == again.series.keys()
    for topic, series in first.series.items():
        assert np.array_equal(series.t, again.series[topic].t), topic
        for field, column in series.columns.items():
            same = again.series[topic][field]
            if field in ("sent", "received"):  # the first flight fetched the table of contents
                column, same = np.diff(column), np.diff(same)
            assert np.array_equal(column, same, equal_nan=True), (topic, field)


def test_a_silent_drone_is_lost_the_others_land_and_it_follows_when_it_is_heard_again(flown):
    outcome, log = flown("silence")
    assert outcome.phase is Phase.ABORTED
    assert outcome.reason == "cf1: link lost: Too many packets lost"
    assert outcome.landed == {"cf1": True, "cf2": True}
    (back,) = said(log, "back after")
    (silent, over) = happened(log, "scenario")
    assert 0.2 < happened(log, "link")[0].t - silent.t < 1.0
    heard = log.series["/cf1/estimate"].t
    assert not ((heard > silent.t + 0.1) & (heard < over.t)).any()
    assert over.t < back.t < over.t + 4.0
    assert heard[-1] > back.t + 1.0  # telemetry runs again


def test_a_link_that_breaks_is_noticed_at_once_and_opened_again(flown):
    outcome, log = flown("reconnect")
    assert outcome.phase is Phase.ABORTED
    assert "cf1: link lost: Error communicating with crazy radio" in outcome.reason
    assert happened(log, "link")[0].t - happened(log, "scenario")[0].t < 0.06
    assert outcome.landed == {"cf1": True, "cf2": True}
    assert said(log, "back after")


def test_a_drone_that_reboots_falls_is_lost_and_says_where_it_lies_when_it_is_back(flown):
    outcome, log = flown("reboot")
    (begun,) = happened(log, "scenario")
    assert outcome.phase is Phase.ABORTED
    assert outcome.landed == {"cf1": True, "cf2": True}
    assert said(log, "cf2: link lost") or said(log, "link lost")
    fall = log.series["/cf2/pose"]
    assert fall["position"][fall.t > begun.t, 2].min() < 0.1
    assert log.series["/cf1/pose"]["position"][:, 2].max() < 0.7


def test_a_battery_is_low_for_five_seconds_before_the_firmware_says_so(flown):
    outcome, log = flown("battery_low")
    assert outcome.reason == "cf1: battery low"
    assert all(outcome.landed.values())
    (begun,), (warned, told) = happened(log, "scenario"), happened(log, "battery")
    assert (warned.level, told.level) == ("warning", "fault")
    assert 2.0 < warned.t - begun.t < told.t - begun.t
    assert 5.0 < told.t - begun.t < 8.0
    battery = log.series["/cf1/battery"]
    assert battery["voltage"][battery.t > told.t - 1.0].max() < 3.3
    assert log.series["/cf2/battery"]["voltage"].min() > 3.5


def test_a_weak_motor_brings_a_drone_off_its_way_and_everybody_down(flown):
    outcome, _ = flown("motor_failure")
    assert outcome.phase is Phase.ABORTED
    assert outcome.reason.startswith("cf2:")
    assert outcome.largest_error["cf2"] > 0.3
    assert outcome.largest_error["cf1"] < 0.05


def test_a_drone_that_rolls_over_is_noticed(flown):
    outcome, log = flown("tumble")
    (begun,) = happened(log, "scenario")
    assert outcome.phase is Phase.ABORTED
    assert outcome.reason.startswith("cf1:")
    rolled = log.series["/cf1/estimate"]
    assert np.abs(rolled["attitude"][rolled.t > begun.t, :2]).max() > 1.0
    assert outcome.largest_error["cf2"] < 0.05


def test_a_short_dropout_of_motion_capture_is_survived_and_a_long_one_lands_everybody(flown):
    outcome, log = flown("mocap_dropout")
    assert outcome.phase is Phase.ABORTED
    assert "no pose for 1.0" in outcome.reason
    assert all(outcome.landed.values())
    first, over, second = (event.t for event in happened(log, "scenario"))
    poses = log.series["/cf1/pose"].t
    assert not ((poses > first + 0.01) & (poses < over)).any()
    assert ((poses > over + 0.01) & (poses < second)).any()
    assert {event.robot for event in happened(log, "pose") if event.t < over} == {"cf1", "cf2"}


def test_swapped_bodies_are_told_apart_and_all_land_with_poses_of_their_own(flown):
    outcome, log = flown("mocap_swap")
    (begun,) = happened(log, "scenario")
    assert outcome.phase is Phase.ABORTED
    assert happened(log, "abort")[0].t - begun.t < 0.05
    assert "cf1 is seen as 'cf2'" in outcome.reason
    assert all(outcome.landed.values())
    for name in ("cf1", "cf2"):
        pose = log.series[f"/{name}/pose"]
        assert np.linalg.norm(np.diff(pose["position"], axis=0), axis=1).max() < 0.05
        assert np.diff(pose.t).max() < 0.05
        assert outcome.largest_error[name] < 0.05


def test_an_outlier_reaches_no_drone_and_nobody_lands(flown):
    outcome, log = flown("mocap_outlier")
    assert outcome.completed, outcome
    begun, over = (event.t for event in happened(log, "scenario"))
    assert over - begun == pytest.approx(0.03, abs=0.011)
    refused, again = happened(log, "mocap")
    assert (refused.robot, again.robot) == ("cf1", "cf1")
    assert refused.value == pytest.approx(0.5, abs=0.05)
    assert "3 poses" in again.text
    for name in ("cf1", "cf2"):
        assert np.abs(np.diff(log.series[f"/{name}/pose"]["position"][:, 0])).max() < 0.05


def test_a_slow_link_shows_in_the_latency_and_commands_are_repeated(flown):
    outcome, log = flown("slow_link")
    assert outcome.phase is Phase.LANDED
    (begun,) = happened(log, "scenario")
    link = log.series["/cf1/link"]
    assert np.nanmax(link["latency_ms"][link.t <= begun.t]) < 60.0
    assert np.nanmax(link["latency_ms"]) >= 120.0
    assert said(log, "no answer, repeated")


def test_the_operator_lands_everybody(flown):
    outcome, log = flown("operator_abort")
    assert outcome.phase is Phase.ABORTED
    assert outcome.reason == "the operator asked to land"
    assert all(outcome.landed.values())
    assert happened(log, "abort")[0].t - happened(log, "scenario")[0].t < 0.011


def test_a_killed_process_leaves_half_a_log_and_drones_that_fly_on(flown):
    outcome, log = flown("process_kill")
    assert isinstance(outcome, HostDied)
    (killed,) = happened(log, "scenario")
    assert outcome.t == pytest.approx(killed.t, abs=0.011)
    assert not log.complete
    assert log.flight_plan.mission == MISSION
    assert max(series.t[-1] for series in log.series.values() if len(series)) <= killed.t + 1e-6
    assert [line.split()[0] for line in outcome.after[:2]] == ["cf1", "cf2"]
    assert not happened(log, "abort")  # no code of the dead process ran


NAMED = {
    "battery_low": "weak battery",
    "loss": "interference",
    "mocap_dropout": "mocap dropout",
    "mocap_outlier": "pose outlier",
    "mocap_swap": "marker swap",
    "motor_failure": "weak motor",
    "operator_abort": "operator",
    "process_kill": "host died",
    "reboot": "restart",
    "reconnect": "dongle",
    "silence": "silence",
    "slow_link": "slow link",
    "tumble": "tumble",
}


@pytest.mark.parametrize("name", NAMES)
def test_the_report_names_the_fault_first_without_being_told(flown, name):
    _, log = flown(name)
    untold = dataclasses.replace(log, events=tuple(event for event in log.events if event.name != "scenario"))
    analysis = analyse(untold)
    first = analysis.verdict.reasons[0]
    assert first.cause
    assert first.name == NAMED[name], analysis.verdict.reasons
    diagnosis = build_report(analysis).partition('id="diagnoses"')[2].partition("</section>")[0]
    assert f"<h3>{first.name}</h3><span>{escape(first.text)}" in diagnosis


def played(tmp_path, event):
    """A flight in which one event happens."""
    scenario = parse_scenario(f"events: [{event}]", path="one.yaml", mission=MISSION)
    path = tmp_path / "flight.mcap"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path))
        outcome, _ = rehearse(small_plan(MISSION), log_path=path, scenario=scenario)
    return outcome, read_log(path)


@pytest.mark.parametrize(
    ("event", "before"),
    [
        ("{fault: reboot, at: 0.0, packets: 40, to: cf2}", "connected"),  # in the middle of its connection
        ("{fault: reboot, when: checked, packets: 5, to: cf2}", "uploaded"),  # in the middle of its upload
        # Between connection and set-up: a drone that is gone is not one that has no such parameter.
        ("{fault: reconnect, at: 0.4, to: cf2, duration: 0.3}", "checked"),
    ],
)
def test_a_conversation_is_hit_in_the_middle_and_begun_again(tmp_path, event, before):
    outcome, log = played(tmp_path, event)
    assert outcome.completed, outcome
    begun, *_ = happened(log, "scenario")
    assert begun.robot == "cf2"
    retry, *more = happened(log, "retry")
    assert {event.robot for event in (retry, *more)} == {"cf2"}
    assert begun.t <= retry.t < next(event.t for event in happened(log, "phase") if event.text == before)


def test_a_drone_that_is_off_from_the_start_is_not_connected(tmp_path):
    outcome, log = played(tmp_path, "{fault: silence, at: 0.0, to: cf2, duration: 0.5}")
    assert outcome.completed, outcome
    (retry,) = happened(log, "retry")
    assert "cf2" in retry.text
    assert retry.t < 1.5  # when everybody else is connected


# ------------------------------------------------------------------------------------------------------ files


def test_every_fault_has_a_file_and_every_file_its_test():
    kinds = {kind.__dataclass_fields__["fault"].default for kind in Fault.__args__}
    assert set(NAMES) == kinds
    source = Path(__file__).read_text(encoding="utf-8")
    assert all(f'flown("{name}")' in source for name in NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_shipped_files_are_for_every_mission_with_two_drones_of_these_names(name):
    mission = load_mission(SHIPPED.parent / "imec_four_drones.yaml")
    scenario = load_scenario(SHIPPED / f"{name}.yaml", mission)
    assert scenario.name == name
    assert {event.fault for event in scenario.events} == {name}


def test_happenings_are_what_the_flight_writes_down():
    folder = Path(deploy.__file__).parent / "flight"
    source = "".join(path.read_text(encoding="utf-8") for path in folder.glob("*.py"))
    assert [name for name in HAPPENINGS if f'"{name}"' not in source and f'"{name} ' not in source] == []


def test_targets():
    assert targets("cf2", MISSION) == ("cf2",)
    assert targets("dongle 0", MISSION) == targets("everybody", MISSION) == ("cf1", "cf2")
    assert targets("dongle 1", MISSION) == targets("cf3", MISSION) == ()


@pytest.mark.parametrize(
    ("event", "expected"),
    [
        ("{fault: lost, at: 1.0}", ["bad.yaml:1: events[0].fault", "lost", "loss, silence", "did you mean 'loss'"]),
        ("{at: 1.0}", ["events[0]", "missing key 'fault'", "process_kill"]),
        ("{fault: silence, at: 1.0, to: cf3}", ["events[0].to", "'cf3'", "cf1, cf2, dongle 0, everybody"]),
        ("{fault: silence, at: 1.0, to: dongle 7}", ["events[0].to", "dongle 7"]),
        ("{fault: silence, at: -1.0}", ["events[0].at", "-1.0", "at least 0", "[s]"]),
        ("{fault: silence, at: 1.0, duration: -2}", ["events[0].duration", "-2", "above 0"]),
        ("{fault: silence, at: soon}", ["events[0].at", "soon", "[s]"]),
        ("{fault: silence}", ["events[0]", "neither", "'at'", "'when'"]),
        ("{fault: silence, at: 1.0, when: landing}", ["events[0]", "both", "'at'", "'when'"]),
        ("{fault: silence, when: on misson}", ["events[0].when", "on misson", "did you mean 'on mission'"]),
        ("{fault: loss, at: 1.0}", ["events[0]", "missing key 'rate'"]),
        ("{fault: loss, at: 1.0, rate: 1.5}", ["events[0].rate", "1.5", "at most 1"]),
        ("{fault: reboot, at: 1.0, duration: 1.0}", ["events[0].duration", "unknown key", "fault reboot"]),
        ("{fault: mocap_swap, at: 1.0, to: cf1, other: cf1}", ["events[0].other", "cf2"]),
        ("{fault: mocap_swap, at: 1.0, other: cf1}", ["events[0].to", "everybody", "cf1, cf2"]),
        ("{fault: motor_failure, at: 1.0, motor: 5}", ["events[0].motor", "5"]),
        ("{fault: reboot, at: 1.0, packets: 3}", ["events[0].packets", "everybody", "one robot"]),
        ("{fault: reboot, at: 1.0, packets: -3, to: cf1}", ["events[0].packets", "-3", "at least 0"]),
        ("{fault: mocap_outlier, at: 1.0, offset: [1.0]}", ["events[0].offset", "1 items", "3"]),
    ],
)
def test_scenarios_that_make_no_sense(event, expected):
    with pytest.raises(MissionError) as refusal:
        parse_scenario(f"events: [{event}]", path="bad.yaml", mission=MISSION)
    assert "\n" not in str(refusal.value)
    for part in expected:
        assert part in str(refusal.value)


def test_no_events_are_no_scenario():
    with pytest.raises(MissionError, match="events"):
        parse_scenario("events: []", path="bad.yaml", mission=MISSION)


def test_the_command_line_refuses_a_scenario_before_it_plans(tmp_path, capsys):
    path = tmp_path / "bad.yaml"
    path.write_text("events:\n  - {fault: reboot, at: 1.0, to: nobody}\n")
    mission = str(SHIPPED.parent / "one_drone.yaml")
    assert main(["dry-run", mission, "--scenario", str(path), "-o", str(tmp_path / "out")]) == 2
    captured = capsys.readouterr()
    (line,) = captured.err.strip().splitlines()
    assert f"{path}:2: events[0].to: got 'nobody'" in line
    assert not (tmp_path / "out").exists()
    assert main(["dry-run", mission, "--scenario", str(tmp_path / "none.yaml"), "-o", str(tmp_path / "out")]) == 2
    assert "none.yaml: no such file" in capsys.readouterr().err


def test_the_scenario_in_the_readme_loads():
    readme = (SHIPPED.parent.parent / "README.md").read_text(encoding="utf-8")
    text = readme.partition("A scenario file says what goes wrong:")[2].split("```")[1]
    scenario = parse_scenario(text, path="README.md", mission=MISSION)
    assert [event.fault for event in scenario.events] == ["loss", "motor_failure", "operator_abort"]
