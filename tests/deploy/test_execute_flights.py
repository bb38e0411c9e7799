"""Whole flights on the simulated radio: good ones, and every way they may end early."""

import dataclasses
import functools
import math
import struct

import numpy as np
import pytest

from deploy.errors import FlightAborted, LinkError, PreflightError
from deploy.flight.records import FlightStatus
from deploy.flightlog.reader import read_log
from deploy.phases import Phase
from deploy.radio.drone import Drone
from deploy.radio.fleet import FleetError
from deploy.radio.simulated.high_level.trajectory import TrajectoryMemory
from deploy.radio.supervisor import Supervisor
from deploy.rehearsal import rehearse
from missions.loader import load_mission
from tests.deploy.flight_bench import (
    PADS,
    SHIFT,
    STARTS,
    At,
    fly_watched,
    gentle,
    on_the_ground,
    small_mission,
    small_plan,
    small_text,
    usual_plan,
)
from tests.tampering import altered

PLAN = usual_plan()
MISSION_STARTS_ABOUT = 5.0  # s of flight clock


@pytest.fixture
def bench(tmp_path, cache):
    """Flies in this test's folder; see ``fly_watched``."""
    return functools.partial(fly_watched, tmp_path, cache)


@pytest.fixture(scope="module")
def good(tmp_path_factory, cache):
    """One flight that goes well: outcome, stage, truth, and what its observer was told."""
    statuses = []
    return *fly_watched(tmp_path_factory.mktemp("good"), cache, observer=statuses.append), statuses


def during_mission(seconds, act):
    """An observer that acts once, some seconds into the mission."""
    done = []

    def observe(status: FlightStatus):
        if not done and status.mission_time >= seconds:
            done.append(status)
            act(status)

    return observe


def test_a_whole_flight(good):
    outcome, ready, truth, statuses = good
    assert outcome.completed, outcome
    assert outcome.phase is Phase.LANDED
    assert outcome.landed == {"cf1": True, "cf2": True}
    assert not outcome.warnings
    assert outcome.start_skew <= 0.02
    assert 0.0 < max(outcome.largest_error.values()) < 0.05
    assert on_the_ground(ready)
    assert gentle(truth)
    ends = np.array(list(STARTS.values())) + SHIFT
    holding = next(k for k, s in enumerate(statuses) if s.phase is Phase.RETURNING) - 1
    assert np.abs(truth[holding, :, :2] - ends).max() < 0.05
    assert np.abs(ready.final[:, :2] - list(PADS.values())).max() < 0.03  # and back on the pads
    order = [status.phase for status in statuses]
    assert sorted(set(order), key=order.index) == sorted(set(order), key=list(Phase).index)
    assert {Phase.TAKING_OFF, Phase.ON_MISSION, Phase.HOLDING, Phase.RETURNING, Phase.LANDING} <= set(order)


def test_the_log_holds_the_flight(good):
    ready = good[1]
    record = read_log(ready.path)
    assert record.complete
    assert record.robots == ("cf1", "cf2")
    names = [event.name for event in record.events]
    assert names.index("upload") < names.index("mission_start") < names.index("mission_end")
    begin, end = (next(e.t for e in record.events if e.name == name) for name in ("mission_start", "mission_end"))
    assert end - begin == pytest.approx(3.0, abs=0.02)
    for topic, least in (("estimate", 60), ("setpoint", 60), ("reference", 30), ("battery", 60), ("supervisor", 60)):
        assert len(record.series[f"/cf1/{topic}"]) >= least
    link = record.series["/cf1/link"]
    assert np.nanmax(link["latency_ms"]) < 11.0  # of simulated time: the computer's load does not show
    assert link["lost"][-1] == 0
    pose = record.series["/cf1/pose"]
    rate = len(pose) / (pose.t[-1] - pose.t[0])
    assert rate == pytest.approx(50.0, rel=0.1)
    reference = record.series["/cf2/reference"]
    assert reference["position"][0] == pytest.approx((*STARTS["cf2"], 0.6), abs=0.01)


def test_one_interrupt_lands_everybody(bench):
    outcome, ready, truth = bench(operator=At(MISSION_STARTS_ABOUT + 1.2))
    assert outcome.phase is Phase.ABORTED
    assert outcome.reason == "the operator asked to land"
    assert outcome.landed == {"cf1": True, "cf2": True}
    assert not outcome.completed
    assert on_the_ground(ready)
    assert gentle(truth)
    moved = np.linalg.norm(ready.final[:, :2] - np.array(list(STARTS.values())), axis=1)
    assert (moved > 0.05).all()
    assert (moved < np.hypot(*SHIFT) - 0.05).all()
    # Braking together keeps them as far apart as the plan does.
    assert np.linalg.norm(truth[:, 0] - truth[:, 1], axis=1).min() > 0.95


@pytest.mark.parametrize("when", [2.2, 3.0, 4.6])  # climbing, in transfer, hovering at the start
def test_an_interrupt_before_the_mission_lands_everybody_too(bench, when):
    outcome, ready, truth = bench(operator=At(when))
    assert outcome.phase is Phase.ABORTED
    assert all(outcome.landed.values())
    assert on_the_ground(ready)
    assert gentle(truth)
    assert truth[:, :, 2].max() > 0.05


def test_two_interrupts_stop_the_motors(bench):
    outcome, ready, _truth = bench(operator=At(MISSION_STARTS_ABOUT, MISSION_STARTS_ABOUT + 0.3))
    assert outcome.phase is Phase.EMERGENCY
    assert "stopped the motors" in outcome.reason
    assert outcome.landed == {"cf1": False, "cf2": False}
    assert not ready.spinning
    assert ready.final[:, 2].max() < 0.2


def test_an_interrupt_on_the_ground_cancels(bench):
    outcome, ready, truth = bench(operator=At(0.5))
    assert isinstance(outcome, FlightAborted)
    assert np.ptp(truth[:, :, 2]) < 0.01
    assert [e.text for e in read_log(ready.path).events if e.name == "phase"][-1] == "cancelled"


def test_low_batteries_are_all_listed_and_nobody_moves(bench):
    outcome, ready, truth = bench(small_plan(small_mission(battery_minimum=4.25)))
    assert isinstance(outcome, PreflightError)
    assert "cf1: battery: 4.1" in str(outcome)
    assert "cf2: battery: 4.1" in str(outcome)
    assert len(outcome.checks) > 20
    assert np.ptp(truth[:, :, 2]) < 0.01
    assert sum(e.name == "preflight" and e.level == "fault" for e in read_log(ready.path).events) == 2


def test_swapped_drones_stay_on_the_ground(bench):
    mission = PLAN.mission
    a, b = mission.robots
    swapped = (dataclasses.replace(a, pad=b.start), dataclasses.replace(b, pad=a.start))
    elsewhere = dataclasses.replace(PLAN, mission=dataclasses.replace(mission, robots=swapped))
    outcome, _, truth = bench(on=elsewhere)
    assert isinstance(outcome, PreflightError)
    assert "stands on the pad of cf2: swap" in str(outcome)
    assert np.ptp(truth[:, :, 2]) < 0.01


def test_an_edited_byte_never_reaches_a_drone(bench, monkeypatch):
    monkeypatch.setattr(Drone, "connect", lambda *_: pytest.fail("connected"))
    encoded = PLAN.trajectories["cf1"]
    data = encoded.legs[0].data
    edited = altered(encoded, data=data[:-1] + bytes([data[-1] ^ 1]))
    outcome, _, _ = bench(dataclasses.replace(PLAN, trajectories={**PLAN.trajectories, "cf1": edited}))
    assert isinstance(outcome, PreflightError)
    assert "the bytes of cf1 are not those that were certified" in str(outcome)


def test_wrong_bytes_read_back_stop_the_flight(bench, monkeypatch):
    stages, honest = [], TrajectoryMemory.read

    def tampered(memory, address, length):
        data = honest(memory, address, length)
        wrong = address == 0 and memory is stages[0].swarm.drones["cf2"]._memory
        return data[:7] + bytes([data[7] ^ 0x80]) + data[8:] if wrong else data

    monkeypatch.setattr(TrajectoryMemory, "read", tampered)
    outcome, _, truth = bench(prepare=stages.append)
    assert isinstance(outcome, FleetError)
    assert "cf2: 1 of 132 bytes read back differ" in str(outcome)
    assert set(outcome.errors) == {"cf2"}
    assert np.ptp(truth[:, :, 2]) < 0.01


def stay_lost(monkeypatch):
    def never(drone, rate):
        raise LinkError(f"{drone.name}: it is off")

    monkeypatch.setattr(Drone, "reconnect", never)


@pytest.mark.parametrize("back", [True, False])
def test_a_lost_link_lands_the_others_and_who_comes_back_lands_too(bench, monkeypatch, back):
    lost = []
    if not back:
        stay_lost(monkeypatch)

    def prepare(ready):
        lost.append(lambda _: ready.swarm._clients["cf1"].lose("Too many packets lost"))

    observer = during_mission(1.0, lambda status: lost[0](status))
    outcome, ready, truth = bench(prepare=prepare, observer=observer)
    assert outcome.phase is Phase.ABORTED
    assert outcome.landed == {"cf1": back, "cf2": True}
    assert any("cf1: link lost: Too many packets lost" in fault for fault in outcome.faults)
    assert any("cf1: back after 0.5" in warning for warning in outcome.warnings) is back
    assert (ready.final[:, 2] < 0.02).tolist() == [back, True]
    assert np.linalg.norm(truth[:, 0] - truth[:, 1], axis=1).min() > 0.3


def on_board(ready):
    """Positions every drone by itself: positions arrive that no radio of ours has sent."""

    def measure(_):
        for drone, position in zip(ready.swarm.drones.values(), ready.world.positions.tolist(), strict=True):
            drone.receive(6 << 4, struct.pack("<fff", *position))

    ready.world.every(0.02, measure)


def test_without_motion_capture_the_drones_say_where_they_are(bench):
    outcome, ready, truth = bench(prepare=on_board, mocap=None)
    assert outcome.completed, outcome
    assert gentle(truth)
    assert "/cf1/pose" not in read_log(ready.path).series


def test_a_drone_that_positions_itself_is_safest_flown_beside_when_its_link_is_lost(bench, monkeypatch):
    stages = []
    stay_lost(monkeypatch)

    def prepare(ready):
        on_board(ready)
        stages.append(ready)

    observer = during_mission(1.0, lambda _: stages[0].swarm._clients["cf1"].lose("Too many packets lost"))
    outcome, ready, _ = bench(prepare=prepare, observer=observer, mocap=None)
    assert outcome.phase is Phase.ABORTED
    assert outcome.reason == "nobody flies back past cf1, who cannot be told to"
    assert outcome.landed == {"cf1": False, "cf2": True}
    ends = np.array(list(STARTS.values())) + SHIFT
    assert np.abs(ready.final[:, :2] - ends).max() < 0.1  # both flew to the end
    assert ready.final[0, 2] > 0.4  # and the lost one still hovers


def test_drones_that_have_to_be_armed_are_armed_and_disarmed(bench):
    outcome, ready, _ = bench(small_plan(small_mission(airframe="cf21_brushless")))
    assert outcome.completed, outcome
    assert on_the_ground(ready)
    assert not any(Supervisor(drone.info).armed for drone in ready.swarm.drones.values())


def test_a_body_lost_to_motion_capture_lands_everybody(bench):
    stages = []
    observer = during_mission(0.5, lambda status: stages[0].mocap.hide({"cf2"}))
    outcome, _ready, truth = bench(prepare=stages.append, observer=observer)
    assert outcome.phase is Phase.ABORTED
    assert "cf2: no pose for 1.0" in outcome.reason
    assert any("no pose for 0." in warning for warning in outcome.warnings)
    assert all(outcome.landed.values())
    assert gentle(truth)


def test_a_bug_in_flight_lands_everybody_before_it_is_reported(bench):
    def bug(status):
        raise ZeroDivisionError("observer")

    outcome, ready, truth = bench(observer=during_mission(1.0, bug))
    assert isinstance(outcome, ZeroDivisionError)
    assert on_the_ground(ready)
    assert gentle(truth)
    assert truth[:, :, 2].max() > 0.5


def test_rehearse_writes_a_complete_log_with_the_plan(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "small.yaml").write_text(small_text(", rigid_body: Alpha").replace("[1.5, 0.4]", "[1.7, 0.4]"))
    plan = small_plan(load_mission(tmp_path / "small.yaml"))
    outcome, path = rehearse(plan, log_path=tmp_path / "flight.mcap", seed=3)
    record = read_log(path)
    assert outcome.completed, outcome
    assert record.complete
    assert record.flight_plan.mission == plan.mission
    assert record.metadata["backend"] == "simulated"
    assert not math.isnan(outcome.start_skew)
    # From its pad to its start, and only then along the trajectory.
    poses = record.series["/cf2/pose"]["position"]
    assert np.abs(poses[0] - [1.7, 0.4, 0.0]).max() < 0.02
    assert np.abs(poses[-1, :2] - [1.7, 0.4]).max() < 0.05
    assert (tmp_path / "cache" / "ergoflie" / "toc" / "simulated").is_dir()
