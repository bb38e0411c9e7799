"""Whole flights that are seen as positions only, or as unlabelled markers."""

import dataclasses
import math

import numpy as np
import pytest

from deploy.cli.fly import _mocap
from deploy.errors import PreflightError
from deploy.flightlog.reader import read_log
from deploy.phases import Phase
from missions.errors import MissionError
from missions.motion_capture import MotionCapture
from missions.radio import pose_rates
from missions.safety import Safety
from missions.schema import Radio
from mocap.errors import MocapUnavailable
from mocap.frames import MappedSource
from mocap.replay import ReplayMocap
from mocap.setup import in_world
from mocap.source import MocapFrame
from tests.deploy.flight_bench import fly_on, small_mission, small_plan, stage

SIDEWAYS = {"up": "y", "unit": 0.001, "origin": (1.0, -2.0, 0.1), "yaw": 0.7, "height": 0.02}


def plan_seen(safety=None, **setup):
    mission = dataclasses.replace(small_mission(), motion_capture=MotionCapture(**setup))
    return small_plan(dataclasses.replace(mission, safety=safety or mission.safety))


def run(folder, cache, plan, prepare=lambda ready: ready.capture, **kwargs):
    """Fly; the outcome, the log and the truth (n, drones, 3) every 10 ms."""
    with stage(folder, plan) as ready:
        truth = []
        ready.world.every(0.01, lambda t: truth.append((t, ready.world.positions)))
        outcome = fly_on(ready, plan, cache, mocap=prepare(ready), **kwargs)
        path = ready.log.path
    return outcome, read_log(path), truth


def error_of_poses(log, truth):
    """Largest distance of a pose in the log from where the drone was [m]."""
    at = np.array([t for t, _ in truth])
    places = np.array([positions for _, positions in truth])
    worst = 0.0
    for i, name in enumerate(("cf1", "cf2")):
        series = log.of(name, "pose")
        nearest = np.abs(at[:, None] - series.t[None]).argmin(axis=0)
        worst = max(worst, float(np.linalg.norm(series["position"] - places[nearest, i], axis=1).max()))
    return worst


@pytest.fixture(scope="module")
def marked(tmp_path_factory, cache):
    """A flight of unlabelled markers in a capture system that stands askew and reports millimetres, y up."""
    return run(tmp_path_factory.mktemp("marked"), cache, plan_seen(tracking="markers", **SIDEWAYS))


@pytest.mark.parametrize("tracking", ["bodies", "positions", "markers"])
def test_every_way_of_tracking_flies_the_whole_mission(tmp_path, cache, tracking, request):
    if tracking == "markers":
        outcome, log, truth = request.getfixturevalue("marked")
    else:
        outcome, log, truth = run(tmp_path, cache, plan_seen(tracking=tracking, **SIDEWAYS))
    assert outcome.completed, outcome
    assert error_of_poses(log, truth) < 0.02
    assert max(outcome.largest_error.values()) < 0.1
    health = log.series["/mocap"]
    assert health["latency_ms"][5:].max() < 15.0  # 5 ms of the system, and the loop's 10 ms
    assert health["worst_latency_ms"][5:].max() <= 20.0 + 1e-6


def test_a_recorded_flight_is_replayed_through_the_tracker_without_a_swap(marked):
    _, log, truth = marked
    points = log.series["/mocap/points"]
    frames = (
        MocapFrame(t, k, {}, _threes(flat))
        for k, (t, flat) in enumerate(zip(points.t.tolist(), points.texts["points"], strict=True))
    )
    setup = MotionCapture(tracking="markers", height=0.02)  # points are logged in the world frame
    replayed = in_world(
        ReplayMocap(frames, lambda: math.inf), dataclasses.replace(small_mission(), motion_capture=setup)
    ).poll()
    at = np.array([t for t, _ in truth])
    seen = 0
    for frame in replayed:
        places = truth[int(np.abs(at - frame.t).argmin())][1]
        for name, pose in frame.bodies.items():
            assert math.dist(pose.position, places[("cf1", "cf2").index(name)]) < 0.02
            seen += 1
    assert seen > 1.9 * len(replayed) - 20


def _threes(flat):
    return tuple(tuple(flat[k : k + 3]) for k in range(0, len(flat), 3))


def test_markers_hidden_for_a_moment_are_known_again(tmp_path, cache):
    plan = plan_seen(tracking="markers")

    def prepare(ready):
        ready.world.every(0.01, lambda t: ready.mocap.hide({"cf1", "cf2"} if 6.0 < t < 6.2 else set()))
        return ready.capture

    outcome, log, truth = run(tmp_path, cache, plan, prepare)
    assert outcome.completed, outcome
    assert error_of_poses(log, truth) < 0.02
    gaps = np.diff(log.of("cf1", "pose").t)
    assert 0.2 < gaps.max() < 0.35


def test_a_second_marker_on_a_pad_keeps_everybody_there(tmp_path, cache):
    plan = plan_seen(Safety(retries=0), tracking="markers")

    def with_a_second_marker_on_a_pad(ready):
        def report(frame):
            return dataclasses.replace(frame, points=(*frame.points, (0.55, 0.4, 0.0)))

        return MappedSource(ready.capture, report)

    with pytest.raises(PreflightError, match="cf1: pose: never seen"):
        run(tmp_path, cache, plan, with_a_second_marker_on_a_pad)


def test_a_marker_lost_for_good_lands_everybody(tmp_path, cache):
    plan = plan_seen(tracking="markers")

    def prepare(ready):
        ready.world.every(0.01, lambda t: ready.mocap.hide({"cf2"} if t > 6.0 else set()))
        return ready.capture

    outcome, _, _ = run(tmp_path, cache, plan, prepare)
    assert outcome.phase is Phase.ABORTED
    assert "cf2: no pose for 1.0" in outcome.reason


def test_a_system_that_nothing_talks_to_is_named_before_take_off(tmp_path):
    path = tmp_path / "motion_capture.yaml"
    path.write_text("/motion_capture_tracking: {ros__parameters: {type: vicon, hostname: 10.0.0.2}}")
    assert callable(_mocap(str(path), "", small_mission()))
    marked = plan_seen(tracking="markers").mission
    with pytest.raises(MocapUnavailable, match=r"\(vicon\): nothing hands over its unlabelled markers"):
        _mocap(str(path), "", marked)
    with pytest.raises(MocapUnavailable, match="got 'vikon'; allowed: vicon"):
        _mocap("vikon", "", small_mission())
    with pytest.raises(MissionError, match=r"nowhere\.yaml"):
        _mocap("nowhere.yaml", "", small_mission())


def test_a_dongle_that_carries_less_gets_fewer_poses(tmp_path, cache):
    mission = dataclasses.replace(small_mission(), radio=Radio(packet_rate=50.0))
    assert pose_rates(mission) == {"cf1": 20.0, "cf2": 20.0}
    assert pose_rates(small_mission()) == {"cf1": 50.0, "cf2": 50.0}
    assert set(pose_rates(dataclasses.replace(mission, radio=Radio(packet_rate=30.0))).values()) == {10.0}
    _, log, _ = run(tmp_path, cache, small_plan(mission))
    assert np.median(np.diff(log.of("cf1", "pose").t)) == pytest.approx(0.05, abs=0.011)
    assert log.series["/mocap"]["sent"][5:].max() <= 42.0
