"""Who flies: drones that fail before take-off are tried again, left behind if that is safe, or keep everybody there."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from deploy.analysis.analyse import _of_those_who_flew
from deploy.errors import DeployError, FlightAborted, LinkError, PreflightError, UploadError
from deploy.execute import check
from deploy.flight import ground
from deploy.flightlog.reader import read_log
from deploy.phases import Phase
from deploy.radio.drone import Drone
from deploy.radio.fleet import FleetError
from missions.connectivity import GuaranteedConnectivity
from missions.safety import Safety
from tests.deploy.flight_bench import equipment, fly_on, small_mission, small_plan, stage


def plan_with(connectivity=None, **safety):
    mission = small_mission()
    changes = {"connectivity": connectivity} if connectivity else {}
    return small_plan(dataclasses.replace(mission, safety=Safety(**safety), **changes))


STRICT, LENIENT = plan_with(), plan_with(min_robots=1)


@pytest.fixture
def bench(tmp_path, cache):
    def run(plan, act=fly_on, nobody=(), prepare=lambda ready: None, **kwargs):
        with stage(tmp_path, plan) as ready:
            truth = []
            ready.world.every(0.1, lambda t: truth.append(ready.world.positions))
            uris = {n: u if n not in nobody else f"sim://bench1/no_{n}" for n, u in ready.swarm.uris().items()}
            prepare(ready)
            try:
                outcome = act(ready, plan, cache, uris=uris, **kwargs)
            except DeployError as error:  # every test looks at what it is
                outcome = error
            ready.path = ready.log.path
        return outcome, ready, np.array(truth)

    return run


def checking(ready, plan, cache, **kwargs):
    return check(plan, equipment(ready, cache, **kwargs))


def nobody_moved(truth):
    return np.ptp(truth[:, :, 2], axis=0).max() < 0.01


def failing(monkeypatch, method, robot, error, times):
    """A method of one drone fails so many times."""
    honest, failed = getattr(Drone, method), []

    def sometimes(drone, *args, **kwargs):
        if drone.name == robot and len(failed) < times:
            failed.append(args)
            raise error
        return honest(drone, *args, **kwargs)

    monkeypatch.setattr(Drone, method, sometimes)
    return failed


def test_a_drone_that_is_not_there_fails_a_check_and_the_others_are_checked_all_the_same(bench):
    outcome, ready, truth = bench(STRICT, nobody={"cf2"})
    assert isinstance(outcome, PreflightError)
    assert "cf2: connection: " in str(outcome)
    assert {c.result for c in outcome.checks if c.robot == "cf1"} == {"pass"}
    assert nobody_moved(truth)
    pauses = [event.text for event in read_log(ready.path).events if event.name == "retry"]
    assert [text.rpartition("again in ")[2] for text in pauses] == ["1 s", "2 s"]


def test_the_others_fly_if_the_mission_says_so_and_their_certificate_passes(bench):
    outcome, ready, truth = bench(LENIENT, nobody={"cf2"})
    assert outcome.phase is Phase.LANDED, outcome
    assert outcome.completed
    assert set(outcome.left_behind) == {"cf2"}
    assert outcome.landed == {"cf1": True}
    assert truth[:, 0, 2].max() > 0.5
    assert truth[:, 1, 2].max() < 0.02
    events = {event.name: event for event in read_log(ready.path).events}
    assert events["left_behind"].robot == "cf2"
    assert "certificate of their bytes passes" in events["certified_anew"].text


def test_too_few_left_keep_everybody_on_the_ground(bench):
    outcome, _, truth = bench(plan_with(min_robots=2), nobody={"cf1"})
    assert isinstance(outcome, PreflightError)
    assert "robots left: 1 (allowed: >= 2 (safety.min_robots))" in str(outcome)
    assert nobody_moved(truth)


def test_who_has_to_be_met_is_not_left_behind(bench):
    meet = GuaranteedConnectivity(range=1.5, duration=1.0, pairs=(("cf1", "cf2"),))
    outcome, _, truth = bench(plan_with(meet, min_robots=1), nobody={"cf2"})
    assert isinstance(outcome, PreflightError)
    assert "certificate of the others: every pair of the connectivity policy has cf2 in it" in str(outcome)
    assert nobody_moved(truth)


@pytest.mark.parametrize(
    ("method", "error"),
    [
        ("connect", LinkError("cf2: connection refused")),
        ("start_telemetry", LinkError("cf2: no answer")),
        ("converse", UploadError("cf2: 1 of 132 bytes read back differ")),
    ],
)
def test_what_fails_once_is_tried_again_and_everybody_flies(bench, monkeypatch, method, error):
    failed = failing(monkeypatch, method, "cf2", error, 1)
    outcome, _, truth = bench(STRICT)
    assert failed
    assert outcome.completed, outcome
    assert any("again in 1 s" in warning for warning in outcome.warnings)
    assert truth[:, :, 2].max(axis=0).min() > 0.5


def test_an_upload_that_fails_for_good_leaves_one_behind_or_everybody(bench, monkeypatch):
    failing(monkeypatch, "converse", "cf2", UploadError("cf2: bytes read back differ"), 99)
    outcome, _, truth = bench(STRICT)
    assert isinstance(outcome, FleetError)
    assert set(outcome.errors) == {"cf2"}
    assert nobody_moved(truth)
    outcome, _, truth = bench(LENIENT)
    assert outcome.completed, outcome
    assert outcome.left_behind == {"cf2": "cf2: bytes read back differ"}
    assert truth[:, 1, 2].max() < 0.02


def test_an_unknown_parameter_is_named_and_not_tried_again(bench):
    outcome, ready, _ = bench(small_plan(small_mission(parameters={"no.such": 1.0})))
    assert isinstance(outcome, PreflightError)
    assert "cf1: it has no parameter 'no.such'" in str(outcome)
    assert "cf2: it has no parameter 'no.such'" in str(outcome)
    assert not [event for event in read_log(ready.path).events if event.name == "retry"]


def lose(ready, robot="cf1"):
    ready.swarm._clients[robot].lose("Too many packets lost")


def test_a_link_lost_while_the_filters_settle_is_opened_again(bench, monkeypatch):
    honest, stages, lost = ground.settle_estimators, [], []

    def settle(flight, names):
        failures = honest(flight, names)
        if not lost:
            lost.append(lose(stages[0]))
        return failures

    monkeypatch.setattr(ground, "settle_estimators", settle)

    outcome, _, _ = bench(STRICT, prepare=stages.append)
    assert lost
    assert outcome.completed, outcome
    assert any("link lost: Too many packets lost; again in 1 s" in warning for warning in outcome.warnings)


def test_a_drone_that_restarts_after_the_upload_does_not_take_off_without_its_trajectory(bench, monkeypatch):
    honest, stages = ground.arm, []

    def arm(flight):
        stages[0].swarm.drones["cf1"].reboot()
        return honest(flight)

    monkeypatch.setattr(ground, "arm", arm)

    outcome, _, truth = bench(STRICT, prepare=stages.append)
    assert isinstance(outcome, FlightAborted)
    assert "cf1: " in str(outcome)
    assert nobody_moved(truth)


@pytest.mark.parametrize(("plan", "flies"), [(STRICT, False), (LENIENT, True)])
def test_a_link_lost_after_the_upload_keeps_that_one_on_the_ground(bench, monkeypatch, plan, flies):
    honest, stages = ground.arm, []

    def arm(flight):
        lose(stages[0])
        return honest(flight)

    monkeypatch.setattr(ground, "arm", arm)

    outcome, _, truth = bench(plan, prepare=stages.append)
    assert truth[:, 0, 2].max() < 0.02
    if flies:
        assert outcome.completed, outcome
        assert outcome.left_behind == {"cf1": "Too many packets lost"}
    else:
        assert isinstance(outcome, FlightAborted)
        assert "cf1: Too many packets lost" in str(outcome)
        assert nobody_moved(truth)


def test_a_drone_that_restarts_right_after_its_upload_is_loaded_again(bench, monkeypatch):
    honest, stages = ground.load, []

    def load(flight, names):
        failures = honest(flight, names)
        if len(stages) == 1:
            stages.append("restarted")
            stages[0].swarm.drones["cf1"].reboot()
        return failures

    monkeypatch.setattr(ground, "load", load)

    outcome, _, _ = bench(STRICT, prepare=stages.append)
    assert outcome.completed, outcome
    assert any("; again in 1 s" in warning for warning in outcome.warnings)


@pytest.mark.parametrize(("plan", "flies"), [(plan_with(retries=0), False), (plan_with(retries=0, min_robots=1), True)])
def test_who_is_not_seen_any_more_after_the_upload_does_not_take_off(bench, monkeypatch, plan, flies):
    honest, stages = ground.load, []

    def load(flight, names):
        failures = honest(flight, names)
        stages[0].mocap.hide({"cf2"})
        flight.wait(0.3)
        return failures

    monkeypatch.setattr(ground, "load", load)

    outcome, _, truth = bench(plan, prepare=stages.append)
    assert truth[:, 1, 2].max() < 0.02
    if flies:
        assert outcome.completed, outcome
        assert "pose:" in outcome.left_behind["cf2"]
    else:
        assert isinstance(outcome, FlightAborted)
        assert "cf2: pose:" in str(outcome)
        assert nobody_moved(truth)


def test_checks_alone_list_everything_and_nobody_is_armed_or_loaded(bench, monkeypatch):
    monkeypatch.setattr("deploy.flight.ground.upload", lambda *_: pytest.fail("uploaded"))
    monkeypatch.setattr(Drone, "request_arming", lambda *_: pytest.fail("armed"))
    report, ready, truth = bench(LENIENT, act=checking, nobody={"cf2"})
    assert {(check.name, check.robot) for check in report.failures} == {("connection", "cf2")}
    names = {check.name for check in report.checks}
    assert {"certificate", "geofence contains the flight", "radio budget", "disk", "battery", "estimator"} <= names
    assert nobody_moved(truth)
    assert [e.text for e in read_log(ready.path).events if e.name == "phase"] == ["idle", "connected", "cancelled"]


def test_the_analysis_is_of_those_who_flew():
    events = [SimpleNamespace(name="left_behind", robot="cf2"), SimpleNamespace(name="phase", robot="")]
    record = SimpleNamespace(flight_plan=LENIENT, events=events)
    assert list(_of_those_who_flew(record).trajectories) == ["cf1"]
    assert _of_those_who_flew(SimpleNamespace(flight_plan=LENIENT, events=events[1:])) is LENIENT
