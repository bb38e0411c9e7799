"""Pre-flight checks: what each finds, and that everything is listed."""

import dataclasses
import math

import pytest

from deploy.errors import PreflightError
from deploy.preflight import (
    DroneFacts,
    PreflightReport,
    check_drone,
    check_limits,
    check_log,
    check_plan,
    check_same,
)
from deploy.radio.link import LinkState
from deploy.radio.supervisor import Supervisor
from tests.deploy.flight_bench import STARTS, small_plan
from tests.tampering import altered

PLAN = small_plan()
UP = LinkState(latency=5.0, quality=100.0, rssi=40.0)
READY = Supervisor(0x020E)


def facts(robot, **changes):
    place = (*STARTS[robot], 0.0)
    good = DroneFacts(robot, 12, "2026.08", 4096, UP, READY, 4.1, place, 0.01, place, 0.0, {"stabilizer.controller": 2})
    return dataclasses.replace(good, **changes)


def checks_of(*drones, external=True):
    same = check_same({drone.robot: drone.firmware for drone in drones})
    return [*(check for drone in drones for check in check_drone(PLAN, drone, external)), same]


def results(*drones, external=True):
    return {(c.name, c.robot): c.result for c in checks_of(*drones, external=external) if c.result != "pass"}


def test_two_good_drones_pass():
    assert results(facts("cf1"), facts("cf2")) == {}
    assert results(facts("cf1", pose=None, pose_age=math.inf, decks=("flow2",)), external=False) == {}


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"link": LinkState(lost="gone")}, "link"),
        ({"link": LinkState(latency=300.0)}, "link latency"),
        ({"link": LinkState(quality=50.0)}, "link quality"),
        ({"protocol": 9}, "protocol"),
        ({"voltage": 3.69}, "battery"),
        ({"voltage": math.nan}, "battery"),
        ({"supervisor": None}, "supervisor"),
        ({"supervisor": Supervisor(0x0042)}, "supervisor"),
        ({"supervisor": Supervisor(0x022F)}, "supervisor"),
        ({"memory": 0}, "trajectory memory"),
        ({"tilt": math.radians(20)}, "level"),
        ({"pose": None}, "pose"),
        ({"pose_age": 0.3}, "pose"),
        ({"estimate": None}, "estimate agrees with pose"),
        ({"estimate": (0.5, 0.56, 0.0)}, "estimate agrees with pose"),
        ({"deviation": 0.06}, "estimator"),
    ],
)
def test_each_check_fails_alone(changes, name):
    assert results(facts("cf1", **changes), facts("cf2")) == {(name, "cf1"): "failure"}


def test_a_slow_link_and_mixed_firmware_are_warnings():
    found = results(facts("cf1", link=LinkState(latency=60.0)), facts("cf2", firmware="2025.02"))
    assert found == {("link latency", "cf1"): "warning", ("same firmware", ""): "warning"}


def test_swapped_drones_are_told_by_name():
    first, second = (*STARTS["cf1"], 0.0), (*STARTS["cf2"], 0.0)
    checks = checks_of(facts("cf1", pose=second, estimate=second), facts("cf2", pose=first, estimate=first))
    wrong = {c.robot: c.remedy for c in checks if c.result == "failure"}
    assert "stands on the pad of cf2" in wrong["cf1"]
    assert "stands on the pad of cf1" in wrong["cf2"]


def test_every_failure_of_every_drone_is_in_the_error():
    checks = checks_of(facts("cf1", voltage=3.0), facts("cf2", voltage=3.1, memory=10))
    with pytest.raises(PreflightError, match="3 pre-flight checks failed") as caught:
        PreflightReport((*checks, *check_log("", 1e4))).require()
    assert all(text in str(caught.value) for text in ("cf1: battery: 3.00 V", "cf2: battery: 3.10 V", "10 bytes"))
    assert len(caught.value.checks) > 20


def test_the_log_has_to_be_written():
    assert [check.result for check in check_log("disk full", 1e4)] == ["failure", "pass"]
    assert [check.result for check in check_log("", 150.0)] == ["pass", "failure"]


def test_without_motion_capture_a_deck_should_know_where_the_drone_is():
    assert results(facts("cf1", decks=()), external=False) == {("positioning deck", "cf1"): "warning"}
    assert results(facts("cf1", decks=None), external=False) == {("positioning deck", "cf1"): "warning"}
    assert results(facts("cf1", decks=("multiranger",)), external=False) == {("positioning deck", "cf1"): "warning"}
    assert results(facts("cf1", decks=()), external=True) == {}


@pytest.mark.parametrize("found", [(), ("flow2",), None])
def test_decks_of_the_mission_have_to_be_there(found):
    mission = dataclasses.replace(
        PLAN.mission,
        robots=(dataclasses.replace(PLAN.mission.robots[0], decks=("lighthouse4",)), PLAN.mission.robots[1]),
    )
    plan = dataclasses.replace(PLAN, mission=mission)

    def deck_checks(decks):
        return [c for c in check_drone(plan, facts("cf1", decks=decks), True) if c.name == "decks"]

    (check,) = deck_checks(found)
    assert check.result == "failure"
    assert check.limit == "lighthouse4"
    assert "push the decks home" in check.remedy
    (check,) = deck_checks(("led_ring", "lighthouse4"))
    assert check.result == "pass"


def test_the_fence_and_the_radio_are_shown_with_what_is_left_of_them():
    inside, radio = check_limits(PLAN)
    assert (inside.name, inside.result) == ("geofence contains the flight", "pass")
    assert inside.value.startswith("0.15 m inside (take-off geofence")
    assert (radio.name, radio.value, radio.limit) == (
        "radio budget",
        "170 1/s (2 drones on the dongle of cf1)",
        "<= 500 1/s",
    )
    tight = [
        dataclasses.replace(c, value=-0.1, passed=False) if c.name == "workspace" else c
        for c in PLAN.certificate.checks
    ]
    assert check_limits(with_checks(tight))[0].result == "failure"
    assert check_limits(with_checks([])) == ()


def test_an_edited_byte_a_swap_and_a_failed_certificate_are_found():
    assert [c.result for c in check_plan(PLAN)] == ["pass", "pass", "pass"]
    encoded = PLAN.trajectories["cf1"]
    data = encoded.legs[0].data
    other = altered(encoded, data=bytes([data[0] ^ 1]) + data[1:])
    edited = dataclasses.replace(PLAN, trajectories={**PLAN.trajectories, "cf1": other})
    assert [c.result for c in check_plan(edited)] == ["pass", "failure", "failure"]
    a, b = PLAN.trajectories.values()
    swapped = dataclasses.replace(PLAN, trajectories={"cf1": b, "cf2": a})
    assert [c.result for c in check_plan(swapped)] == ["pass", "failure", "failure"]
    failing = dataclasses.replace(PLAN.certificate.checks[0], passed=False)
    uncertified = dataclasses.replace(PLAN, certificate=dataclasses.replace(PLAN.certificate, checks=(failing,)))
    assert [c.result for c in check_plan(uncertified)] == ["failure", "pass", "failure"]


def with_checks(checks):
    return dataclasses.replace(PLAN, certificate=dataclasses.replace(PLAN.certificate, checks=tuple(checks)))


def test_a_certificate_whose_hashes_fit_but_whose_figures_do_not_is_found():
    """Hashes bind a certificate to bytes; only computing it again binds its figures to them."""
    first, *others = PLAN.certificate.checks
    kinder = with_checks([dataclasses.replace(first, value=first.value + 0.05), *others])
    assert [c.result for c in check_plan(kinder)] == ["pass", "pass", "failure"]
    assert "another result for separation" in str(check_plan(kinder)[2])
    assert [c.result for c in check_plan(with_checks(others))] == ["pass", "pass", "failure"]
    assert [c.result for c in check_plan(with_checks([]))] == ["failure", "pass", "failure"]
    advice = with_checks([dataclasses.replace(first, passed=False, severity="warning"), *others])
    assert [c.result for c in check_plan(advice)] == ["pass", "pass", "failure"]
