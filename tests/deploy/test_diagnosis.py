"""Each diagnosis on a synthetic flight with one fault: it is named, with its figures, and nothing else is."""

import dataclasses
import math

import numpy as np
import pytest

from deploy.analysis.analyse import analyse
from deploy.analysis.diagnosis.frames import fitted
from deploy.analysis.diagnosis.oscillation import swing
from deploy.analysis.findings import Finding, Level, ordered
from deploy.flightlog.reader import Event, Series, read_log
from tests.deploy import synthetic_flight as synthetic

BEGIN = synthetic.TAKEOFF + synthetic.SETTLE


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    path = tmp_path_factory.mktemp("flight") / "flight.mcap"
    synthetic.write_flight(path, synthetic.flight_plan())
    return read_log(path)


def changed(record, topic, field, change):
    """The record with a series' field made anew: ``change(t, values)`` with t since the search began."""
    series = record.series[topic]
    columns = {**series.columns, field: change(series.t - BEGIN, series[field].copy())}
    return dataclasses.replace(record, series={**record.series, topic: Series(series.t, columns, series.texts)})


def moved(record, change, robots=("cf1", "cf2", "cf3", "cf4")):
    """The record with these robots' poses made anew."""
    for robot in robots:
        record = changed(record, f"/{robot}/pose", "position", change)
    return record


def with_series(record, topic, t, columns=None, texts=None):
    return dataclasses.replace(record, series={**record.series, topic: Series(t, columns or {}, texts or {})})


def causes(record):
    return {item.name: item for item in analyse(record).verdict.diagnoses}


def only(record, name):
    """The one diagnosis of a record."""
    found = analyse(record).verdict.diagnoses
    assert [item.name for item in found] == [name] * len(found), found
    return found[0]


def test_a_good_flight_has_nothing_to_be_diagnosed(good):
    assert causes(good) == {}


# --------------------------------------------------------------------------------------------------------- frames


@pytest.mark.parametrize("turn", [-3.0, 2.0, 8.0])
def test_a_turned_frame_is_named_with_its_angle(good, turn):
    angle = math.radians(turn)
    R = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])

    def turned(t, q):
        q[:, :2] = (q[:, :2] - [1.5, 1.25]) @ R.T + [1.5, 1.25]
        return q

    found = causes(moved(good, turned))["frame alignment"]
    assert found.level is Level.WARN
    said = float(found.text.partition("turned by ")[2].partition("°")[0])
    assert said == pytest.approx(turn, abs=0.3)
    assert "motion_capture.origin and yaw" in found.remedy


def test_a_shifted_frame_is_named_with_its_shift(good):
    found = causes(moved(good, lambda t, q: q + np.array([0.04, -0.03, 0.0])))["frame alignment"]
    assert "shifted by (+4.0, -3.0, +0.0) cm" in found.text
    assert "turned" not in found.text


def test_one_robot_beside_its_trajectory_is_its_rigid_body(good):
    found = causes(moved(good, lambda t, q: q + np.array([0.0, 0.05, 0.02]), ["cf3"]))["rigid body"]
    assert found.robots == ("cf3",)
    assert "(+0.0, +5.0, +2.0) cm" in found.text


def test_a_drift_is_no_frame(good):
    assert "frame alignment" not in causes(moved(good, lambda t, q: q + np.outer(t / 12.0, [0.15, 0.0, 0.0])))


@pytest.mark.parametrize("angle", [-2.0, -0.3, 0.0, 1e-3, 3.1])
def test_the_fit_finds_a_rigid_motion_exactly(angle):
    rng = np.random.default_rng(5)
    r = rng.normal(size=(200, 3))
    c, s = math.cos(angle), math.sin(angle)
    centre, shift = r.mean(axis=0), np.array([0.3, -0.2, 0.1])
    q = centre + shift + (r - centre) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    fit = fitted(r, q)
    assert fit.turn == pytest.approx(angle, abs=1e-12)
    assert fit.shift == pytest.approx(shift)
    assert fit.left < 1e-20


def test_a_body_defined_with_another_heading_is_named(good):
    half = math.radians(15.0) / 2.0

    def turned(t, q):
        # Noise, as any tracker has; what never changes at all is no measured orientation.
        half_turn = half + 1e-3 * np.random.default_rng(1).standard_normal(len(t))
        return np.stack([0.0 * t, 0.0 * t, np.sin(half_turn), np.cos(half_turn)], axis=1)

    found = causes(changed(good, "/cf2/pose", "orientation", turned))["frame alignment"]
    assert found.robots == ("cf2",)
    assert "+15°" in found.text


# --------------------------------------------------------------------------------------------------------- motion


def test_an_oscillation_is_named_with_axis_frequency_and_amplitude(good):
    def swung(t, q):
        q[:, 1] += 0.03 * np.sin(2.0 * np.pi * 1.7 * t)
        return q

    found = only(moved(good, swung, ["cf2"]), "oscillation")
    assert found.text == "cf2 swings along y at 1.7 Hz by ±3.0 cm"
    assert "ctrlMel.kp_xy" in found.remedy


@pytest.mark.parametrize(("frequency", "amplitude"), [(0.8, 0.02), (2.35, 0.05), (6.0, 0.016)])
def test_an_oscillation_is_measured_right(frequency, amplitude):
    t = np.arange(0.0, 15.0, 0.02)
    y = amplitude * np.sin(2.0 * np.pi * frequency * t) + 0.002 * np.random.default_rng(2).standard_normal(len(t))
    found = swing(t, y)
    assert found.frequency == pytest.approx(frequency, abs=0.07)
    assert found.amplitude == pytest.approx(amplitude, rel=0.1)


def test_what_is_no_oscillation():
    t, rng = np.arange(0.0, 15.0, 0.02), np.random.default_rng(3)
    assert swing(t, 0.01 * rng.standard_normal(len(t))) is None  # noise
    assert swing(t, 0.1 * np.exp(-(((t - 7.0) / 0.3) ** 2))) is None  # a blow
    assert swing(t, 0.005 * np.sin(9.0 * t)) is None  # too small to matter
    assert swing(t, 0.1 * np.sin(1.0 * t)) is None  # slow: that is the trajectory's


def test_a_robot_that_is_late_by_its_controller_falls_behind(good):
    series, estimate = (good.series[f"/cf2/{topic}"] for topic in ("pose", "estimate"))

    def behind(times):
        q = series["position"]
        return np.stack([np.interp(times - 0.25, series.t, q[:, axis]) for axis in range(3)], axis=1)

    late = changed(good, "/cf2/pose", "position", lambda t, _: behind(series.t))
    late = changed(late, "/cf2/estimate", "position", lambda t, _: behind(estimate.t))
    found = only(late, "falls behind")
    assert found.robots == ("cf2",)
    assert float(found.text.partition("by ")[2].partition(" ms")[0]) == pytest.approx(320.0, abs=20.0)
    assert "limits.acceleration" in found.remedy


def test_a_robot_that_sinks_under_another_is_downwash(good):
    tracked = {item.robot: item for item in analyse(good).tracking}
    t_pass = BEGIN + 6.0
    below = good.series["/cf2/pose"]
    over = below["position"].copy()
    near = np.abs(below.t - t_pass) < 0.4

    def above(t, q):
        apart = np.where(near, 0.0, 1.2)
        q[:, 0], q[:, 1] = over[:, 0] + apart, over[:, 1]
        q[:, 2] = over[:, 2] + 0.5
        return q

    def sunk(t, q):
        q[:, 2] -= 0.08 * np.exp(-(((t - 6.1) / 0.2) ** 2))
        return q

    assert len(tracked) == 4
    found = causes(moved(moved(good, above, ["cf1"]), sunk, ["cf2"]))["downwash"]
    assert found.robots == ("cf2", "cf1")
    assert "cf2 sank 8 cm" in found.text
    assert "0.5" in found.text
    assert "vertical_separation" in found.remedy


def test_poses_stamped_late_are_a_time_offset(good):
    late = good
    for robot in ("cf1", "cf2", "cf3", "cf4"):
        series = late.series[f"/{robot}/pose"]
        late = with_series(late, f"/{robot}/pose", series.t + 0.2, series.columns, series.texts)
    found = causes(late)["time offset"]
    assert "everybody" in found.text
    assert "late" in found.text
    assert float(found.text.partition(" are ")[2].partition(" ms")[0]) == pytest.approx(200.0, abs=25.0)
    assert "motion_capture.latency" in found.remedy


def test_one_trajectory_that_began_late_is_named(good):
    series = good.series["/cf3/setpoint"]
    found = causes(with_series(good, "/cf3/setpoint", series.t + 0.25, series.columns, series.texts))["time offset"]
    assert found.robots == ("cf3",)
    assert "setpoints of cf3 ran" in found.text


# ----------------------------------------------------------------------------------------------------- identities


def exchanged(record, begin, end=math.inf):
    a, b = (record.series[f"/{name}/pose"]["position"] for name in ("cf1", "cf2"))
    for name, own, other in (("cf1", a, b), ("cf2", b, a)):
        record = changed(
            record,
            f"/{name}/pose",
            "position",
            lambda t, q, own=own, other=other: np.where(((t >= begin) & (t < end))[:, None], other, own),
        )
    return record


def test_swapped_markers_are_named_with_both_robots_and_the_moment(good):
    found = causes(exchanged(good, 5.0, 7.0))["marker swap"]
    assert found.level is Level.FAIL
    assert found.robots == ("cf1", "cf2")
    assert "at 5.0 s" in found.text


def test_robots_that_flew_each_others_trajectories_are_named(good):
    found = causes(exchanged(good, -math.inf))["exchanged robots"]
    assert found.robots == ("cf1", "cf2")
    assert "URIs" in found.remedy


def test_an_outlier_is_named_and_is_no_swap(good):
    def beside(t, q):
        q[(t > 4.0) & (t < 4.05)] += [0.4, 0.0, 0.0]
        return q

    found = only(moved(good, beside, ["cf4"]), "pose outlier")
    assert "cf4 0.40 m beside itself for 0.04 s, at 4.0 s" in found.text


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("swap", "marker swap"),
        ("teleport", "pose outlier"),
        ("jump", "frame alignment"),
        ("frozen", "frozen pose"),
        ("attitude", "pose outlier"),
        ("again", None),
        ("", None),
    ],
)
def test_what_the_gate_kept_back_is_named_by_its_kind_not_by_its_words(good, kind, name):
    event = Event(BEGIN + 2.0, "mocap", "changed names, repeats one pose", "on mission", "cf1", "warning", 0.3, kind)
    found = causes(dataclasses.replace(good, events=(*good.events, event, event)))
    assert list(found) == ([name] if name else [])
    assert all("changed names, repeats one pose, at 2.0 s" in item.text for item in found.values())


def test_everybody_unseen_at_once_is_the_system_and_one_alone_his_markers(good):
    def without(record, robots):
        for robot in robots:
            series = record.series[f"/{robot}/pose"]
            keep = (series.t < BEGIN + 3.0) | (series.t > BEGIN + 4.0)
            columns = {name: values[keep] for name, values in series.columns.items()}
            record = with_series(record, f"/{robot}/pose", series.t[keep], columns)
        return record

    assert "saw nobody for 1.0 s, at 3.0 s" in only(without(good, good.robots), "mocap dropout").text
    assert only(without(good, ["cf2"]), "markers hidden").robots == ("cf2",)


# ------------------------------------------------------------------------------------------------ motors, batteries


def with_motors(record, robot, power):
    """Motor commands (4,) from a function of the time since the search began, at telemetry's rate."""
    t = record.series[f"/{robot}/battery"].t
    share = np.array([power(at - BEGIN) for at in t.tolist()])
    return with_series(record, f"/{robot}/motors", t, {f"m{k + 1}": 65535 * share[:, k] for k in range(4)})


def test_motors_at_their_limit_are_saturation(good):
    found = only(with_motors(good, "cf1", lambda t: [0.97, 1.0, 0.9, 0.95] if 2 < t < 4 else [0.6] * 4), "saturation")
    assert found.robots == ("cf1",)
    assert "16 % of the search, first at 2.1 s" in found.text


def test_one_motor_alone_at_its_limit_is_a_weak_motor(good):
    found = only(with_motors(good, "cf2", lambda t: [0.4, 0.4, 1.0, 0.4] if 2 < t < 4 else [0.6] * 4), "weak motor")
    assert "cf2's motor m3" in found.text
    assert found.level is Level.FAIL


def test_motors_that_do_their_work_are_no_fault(good):
    assert causes(with_motors(good, "cf1", lambda t: [0.9, 0.55, 0.6, 0.7])) == {}


def test_a_battery_that_falls_or_sags_is_weak(good):
    empty = changed(good, "/cf3/battery", "voltage", lambda t, v: v - 0.9 * np.clip(t, 0.0, 12.0) / 12.0)
    found = only(empty, "weak battery")
    assert found.robots == ("cf3",)
    assert "below the others" in found.text
    worn = only(changed(good, "/cf1/battery", "voltage", lambda t, v: v - 0.8 * (t > -4.9) + 0.15), "weak battery")
    assert worn.robots == ("cf1",)


# ---------------------------------------------------------------------------------------------------------- radio


def on_channels(record, channels):
    plan = record.flight_plan
    robots = tuple(
        dataclasses.replace(robot, uri=f"radio://0/{channel}/2M/E7E7E7E70{k}")
        for k, (robot, channel) in enumerate(zip(plan.mission.robots, channels, strict=True))
    )
    mission = dataclasses.replace(plan.mission, robots=robots)
    out = dataclasses.replace(record)
    out.__dict__["flight_plan"] = dataclasses.replace(plan, mission=mission)
    return out


def disturbed(record, robots):
    for robot in robots:
        record = changed(record, f"/{robot}/link", "quality", lambda t, v: np.where((t > 4.0) & (t < 6.0), 88.0, v))
    return record


def test_interference_is_told_by_the_channel_that_has_it(good):
    found = only(on_channels(disturbed(good, ["cf1", "cf3"]), [40, 80, 40, 80]), "interference")
    assert "channel 40" in found.text
    assert found.robots == ("cf1", "cf3")
    assert "88.0 %" in found.text


def test_one_bad_link_among_good_ones_is_no_interference(good):
    found = only(on_channels(disturbed(good, ["cf2"]), [80] * 4), "weak link")
    assert found.robots == ("cf2",)


def test_a_slow_radio_without_losses_is_named(good):
    record = good
    for robot in good.robots:
        record = changed(record, f"/{robot}/link", "latency_ms", lambda t, v: v + 100.0)
    assert "dongle 0 was slow" in causes(record)["slow link"].text


@pytest.mark.parametrize(
    ("falls", "text", "name"),
    [
        (True, "Too many packets lost", "restart"),
        (False, "Too many packets lost", "silence"),
        (False, "unplugged!", "dongle"),
    ],
)
def test_a_lost_robot_fell_or_flew_on_or_its_dongle_went(good, falls, text, name):
    event = Event(BEGIN + 6.4, "link", f"link lost: {text}", "on mission", "cf2", "fault")
    record = dataclasses.replace(good, events=(*good.events, event))
    series = record.series["/cf2/estimate"]
    keep = series.t < BEGIN + 6.0
    record = with_series(
        record, "/cf2/estimate", series.t[keep], {name: values[keep] for name, values in series.columns.items()}
    )
    if falls:

        def fallen(t, q):
            q[:, 2] = np.where(t > 6.0, np.maximum(0.0, q[:, 2] - 4.9 * (t - 6.0) ** 2), q[:, 2])
            return q

        record = moved(record, fallen, ["cf2"])
    found = causes(record)[name]
    assert found.robots == ("cf2",)
    assert found.t == pytest.approx(BEGIN + 6.0, abs=0.11)


# --------------------------------------------------------------------------------------------------------- verdict


def test_a_robot_that_rolls_over_is_named(good):
    def rolled(t, rpy):
        rpy[:, 0] = np.where(t > 5.0, 2.8, rpy[:, 0])
        return rpy

    found = only(changed(good, "/cf1/estimate", "attitude", rolled), "tumble")
    assert "cf1 rolled over at 5.1 s: its tilt went from 0° to 160°" in found.text


def test_a_log_that_ends_in_the_air_is_a_dead_computer(good):
    end = BEGIN + 5.0
    series = {
        name: Series(
            item.t[item.t < end],
            {field: values[item.t < end] for field, values in item.columns.items()},
            {field: values[: int((item.t < end).sum())] for field, values in item.texts.items()},
        )
        for name, item in good.series.items()
    }
    events = tuple(event for event in good.events if event.t < end)
    found = only(dataclasses.replace(good, series=series, events=events, complete=False), "host died")
    assert "at 5.0 s" in found.text


def test_the_operators_word_is_the_reason(good):
    event = Event(BEGIN + 6.0, "abort", "the operator asked to land (land_all)", "aborting", "", "fault")
    assert causes(dataclasses.replace(good, events=(*good.events, event)))["operator"].level is Level.FAIL


def test_three_reasons_causes_first_and_no_name_twice():
    def finding(level, name, text="", cause=False):
        return Finding(level, name, text, cause=cause)

    listed = [
        finding(Level.PASS, "log"),
        finding(Level.FAIL, "event", "1"),
        finding(Level.FAIL, "event", "2"),
        finding(Level.WARN, "weak link", cause=True),
        finding(Level.FAIL, "landing"),
        finding(Level.FAIL, "tumble", cause=True),
    ]
    verdict = ordered(listed)
    assert verdict.level is Level.FAIL
    assert [item.name for item in verdict.reasons] == ["tumble", "event", "landing"]
    assert [item.name for item in verdict.diagnoses] == ["tumble", "weak link"]
    assert [item.name for item in ordered(listed[:1]).reasons] == ["log"]
