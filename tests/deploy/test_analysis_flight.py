"""What the analysis says of flights whose truth is known."""

import dataclasses
import json

import numpy as np
import pytest

from deploy.analysis.align import mission_window, sample
from deploy.analysis.analyse import analyse
from deploy.analysis.coverage import _over_time, _running
from deploy.analysis.findings import Level
from deploy.analysis.tracking import track
from deploy.errors import LogFileError
from deploy.flightlog.reader import Event, Series, read_log
from planner.indicators import ergodic_metric
from planner.trajectory.encode import decode
from planner.trajectory.timeline import Timeline
from tests.deploy import synthetic_flight as synthetic


@pytest.fixture(scope="module")
def plan():
    return synthetic.flight_plan()


@pytest.fixture(scope="module")
def logs(plan, tmp_path_factory):
    folder = tmp_path_factory.mktemp("flights")
    made = {}

    def log(fault="", **options):
        key = (fault, *options.items())
        if key not in made:
            path = folder / f"{len(made)}.mcap"
            synthetic.write_flight(path, plan, fault=fault, **options)
            made[key] = read_log(path)
        return made[key]

    return log


def findings(analysis, level):
    return {item.name: item.text for item in analysis.verdict.findings if item.level is level}


def test_a_good_flight_passes_and_its_figures_are_right(logs, plan):
    analysis = analyse(logs())
    assert analysis.verdict.level is Level.PASS
    assert analysis.window == dataclasses.replace(analysis.window, start=5.0, end=17.0, complete=True)
    for item in analysis.tracking:
        assert item.lag[0] == pytest.approx(0.07, abs=0.01)
        assert item.lag[1] == pytest.approx(0.07, abs=0.005)
        assert np.isnan(item.lag[2])  # level flight says nothing about lag in z
        assert item.residual == pytest.approx(0.003 * 1.596, rel=0.05)  # mean of a 3-D Gaussian's norm
        assert item.seen == 1.0
    assert analysis.separation.smallest == pytest.approx(plan.certificate.indicators.smallest_separation, abs=0.02)
    assert analysis.coverage.flown.ergodicity == pytest.approx(analysis.coverage.certified.ergodicity, rel=0.03)
    assert json.loads(json.dumps(analysis.summary(), allow_nan=False))["verdict"] == "PASS"


def test_a_flight_without_lag_and_noise_has_the_certified_indicators(logs):
    analysis = analyse(logs(lag=0.0, noise=0.0))
    flown, certified = analysis.coverage.flown, analysis.coverage.certified
    assert flown.ergodicity == pytest.approx(certified.ergodicity, rel=2e-3)
    assert flown.probability_worst == pytest.approx(certified.probability_worst, rel=1e-3)
    assert max(item.largest for item in analysis.tracking) < 1e-3
    for pair in analysis.meetings:
        assert len(pair.flown) == len(pair.certified)


def test_ergodicity_over_time_ends_at_the_ergodicity(plan):
    metric, q = ergodic_metric(plan.mission), plan.plan.q[:-1]
    curve = _over_time(metric, _running(metric, q))
    for steps in (1, 37, len(q)):
        assert curve[steps - 1] == pytest.approx(metric.value(q[:steps]), rel=1e-9)


@pytest.mark.parametrize("lag", [0.0, 0.13, 0.4])
def test_lag_is_found_whatever_it_is(plan, lag):
    name = plan.mission.robots[1].name
    reference = decode(plan.trajectories[name])
    t = np.arange(0.0, 12.0, 0.02)
    window = synthetic_window(12.0)
    motion = synthetic_motion(t, reference.evaluate(t - lag)[:, None, :3])
    course = Timeline.of(plan.trajectories[name], [window.start])
    assert track(name, 0, motion, window, reference, course).mean_lag == pytest.approx(lag, abs=3e-3)


def synthetic_window(duration):
    from deploy.analysis.align import MissionWindow

    return MissionWindow(0.0, duration, True)


def synthetic_motion(t, q):
    from deploy.analysis.align import Motion

    return Motion(t, q, "pose")


@pytest.mark.parametrize(
    ("fault", "level", "name", "text"),
    [
        ("drift", Level.FAIL, "tracking", "worst cf2"),
        ("drift", Level.FAIL, "event", "0.31 m off"),
        ("link", Level.WARN, "link", "cf1: 55 packets lost"),
        ("battery", Level.WARN, "weak battery", "cf3's battery fell to"),
        ("gap", Level.WARN, "markers hidden", "cf4 alone was not seen for 1.50 s, at 3.0 s"),
    ],
)
def test_each_fault_is_named(logs, fault, level, name, text):
    analysis = analyse(logs(fault))
    assert analysis.verdict.level is level
    assert text in findings(analysis, level)[name]


def test_faults_of_the_record_itself_are_named(logs):
    good = logs()

    def judged(**changes):
        return analyse(dataclasses.replace(good, **changes))

    never = judged(events=tuple(e for e in good.events if e.name != "mission_start"))
    assert "never began" in findings(never, Level.FAIL)["mission"]
    until = [event for event in good.events if event.t < 12.0]
    early = judged(events=(*until, Event(12.0, "abort", "fence", "aborting")))
    assert findings(early, Level.FAIL)["mission"] == "the search ended after 7.0 s of 12.0 s"
    assert "last phase is 'aborting'" in findings(early, Level.FAIL)["landing"]
    assert early.coverage.flown is None
    assert np.isfinite(early.coverage.flown_over_time).any()
    dropped = judged(summary={"dropped": "3"})
    assert "3 records were dropped" in findings(dropped, Level.WARN)["log"]
    cut = judged(problems=("the file ends early: it was not closed",), complete=False)
    assert cut.verdict.level is Level.WARN
    with pytest.raises(LogFileError, match="holds no flight plan"):
        analyse(dataclasses.replace(good, attachments={}))


def test_two_drones_too_close_fail(logs):
    good = logs()
    series = dict(good.series)
    pose, other = series["/cf1/pose"], series["/cf2/pose"]
    q = pose["position"].copy()
    near = (pose.t > 9.0) & (pose.t < 10.0)
    q[near] = other["position"][near] + np.array([0.1, 0.0, 0.0])
    series["/cf1/pose"] = Series(pose.t, {**pose.columns, "position": q}, pose.texts)
    analysis = analyse(dataclasses.replace(good, series=series))
    assert "(cf1–cf2" in findings(analysis, Level.FAIL)["separation"]
    assert analysis.separation.smallest == pytest.approx(0.1, abs=1e-6)


def test_drones_that_stand_on_the_floor_are_in_nobodys_way(logs):
    good = logs()
    series = dict(good.series)
    for name in ("cf1", "cf2"):  # motion capture sees both in one place
        pose = series[f"/{name}/pose"]
        q = np.where((pose.t < 1.0)[:, None], 0.0, pose["position"])
        series[f"/{name}/pose"] = Series(pose.t, {**pose.columns, "position": q}, pose.texts)
    analysis = analyse(dataclasses.replace(good, series=series))
    assert "separation" not in findings(analysis, Level.FAIL)
    assert analysis.separation.distance.min() == 0.0


def test_positions_nobody_saw_are_not_invented():
    t = np.array([0.0, 0.1, 1.0, 1.1])
    series = Series(t, {"position": np.stack([t, t, t], axis=1)}, {})
    out = sample(series, "position", np.array([0.05, 0.5, 1.0, 1.2, 1.5]))
    assert np.isnan(out[:, 0]).tolist() == [False, True, False, False, True]
    assert out[0, 0] == pytest.approx(0.05)
    assert np.isnan(sample(None, "position", t)).all()


def test_the_window_of_a_cut_log_ends_with_the_log(logs):
    good = logs()
    started = dataclasses.replace(good, events=tuple(e for e in good.events if e.name != "mission_end"))
    window = mission_window(started, 100.0)
    assert not window.complete
    assert window.end == pytest.approx(22.0)
