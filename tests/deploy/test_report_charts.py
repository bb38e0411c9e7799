"""What charts are made of: packed numbers, groups of robots, readings that say what to do."""

import base64
import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from deploy.analysis.analyse import analyse
from deploy.analysis.meetings import PairMeetings
from deploy.flightlog.reader import read_log
from deploy.report.charts.machine import battery, motors
from deploy.report.charts.motion import tracking
from deploy.report.charts.search import _count
from deploy.report.checks import parameters_table
from deploy.report.maps import maps_data
from deploy.report.packing import packed
from deploy.report.playback import playback_data
from deploy.report.tables import moment, table
from deploy.report.verdict import diagnoses
from tests.deploy import synthetic_flight as synthetic


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    path = tmp_path_factory.mktemp("flight") / "flight.mcap"
    synthetic.write_flight(path, synthetic.flight_plan(duration=6.0, robots=2), fault="link")
    return analyse(read_log(path))


def unpack(data):
    steps = np.frombuffer(base64.b64decode(data["data"]), "<u2").astype(float)
    values = data["lo"] + steps * (data["hi"] - data["lo"]) / 65534.0
    return np.where(steps == 65535, np.nan, values)


@given(st.lists(st.floats(-1e6, 1e6) | st.just(float("nan")), max_size=50))
def test_packed_numbers_are_exact_to_a_fraction_of_their_range_and_gaps_stay_gaps(values):
    values = np.array(values, dtype=float)
    data = packed(values)
    again = unpack(data)
    assert np.array_equal(np.isnan(again), np.isnan(values))
    known = ~np.isnan(values)
    assert np.abs(again[known] - values[known]).max(initial=0.0) <= (data["hi"] - data["lo"]) / 65534.0 + 1e-9


def test_groups_are_counted_through_others():
    def pair(a, b, *flown):
        return PairMeetings((a, b), (), flown, (), (), ())

    names = ["a", "b", "c", "d"]
    pairs = (pair("c", "d", (0.0, 1.0)), pair("b", "c", (0.0, 2.0)), pair("a", "b", (0.5, 1.0)), pair("a", "c"))
    t = np.array([0.0, 0.7, 1.5, 3.0])
    assert _count(t, pairs, names, flown=True).tolist() == [2.0, 1.0, 3.0, 4.0]
    assert _count(t, pairs, names, flown=False).tolist() == [4.0] * 4


def test_a_lag_says_whose_it_is_and_what_to_do(flight):
    assert "mean lag 7" in tracking(flight)["reading"]
    assert "raise ctrlMel.kp_xy and kd_xy" in tracking(flight)["reading"]
    late = tuple(dataclasses.replace(item, setpoint=0.06) for item in flight.timings)
    assert "look at the radio's latency" in tracking(dataclasses.replace(flight, timings=late))["reading"]


def test_motors_and_batteries_say_how_much_is_left(flight):
    assert "cf1, with a motor at 62 %" in motors(flight)["reading"]
    assert "thrust in reserve" in motors(flight)["reading"]
    reading = battery(flight)["reading"]
    assert "above the limit" in reading
    assert "would be empty first" in reading
    slope, left = flight.batteries[0].slope, flight.batteries[0].left
    final = 2 * (synthetic.TAKEOFF + synthetic.SETTLE) + 6.0
    assert slope == pytest.approx(-0.35 / final, rel=0.05)
    assert left == pytest.approx((4.05 - 0.12 - 0.35 * 11.0 / final - 2.8) / (0.35 / final), rel=0.05)


def test_parameters_are_told_once_and_for_whom(flight):
    listed = parameters_table(flight)
    assert listed.count("stabilizer.controller") == 1
    assert "<td >all</td>" in listed
    events = tuple(
        dataclasses.replace(event, text=event.text.replace("= 2", "= 1")) if event.robot == "cf2" else event
        for event in flight.record.events
    )
    other = dataclasses.replace(flight, record=dataclasses.replace(flight.record, events=events))
    assert parameters_table(other).count("stabilizer.controller") == 2
    assert "<td >cf2</td>" in parameters_table(other)


def test_cells_are_escaped_unless_they_are_ours():
    made = table(["a"], [["<b>"], [moment(1.5, "<i>")]], "<c>")
    assert "&lt;b&gt;" in made
    assert '<button type="button" class="moment" data-at="1.500">&lt;i&gt;</button>' in made
    assert "&lt;c&gt;" in made


def test_long_tables_are_folded():
    assert table(["a"], [["x"]] * 30, "few").startswith("<div")
    assert table(["a"], [["x"]] * 31, "many").startswith("<details><summary>many: 31 lines")


def test_a_diagnosis_leads_to_its_moment_and_says_what_to_do(flight):
    (found,) = flight.verdict.diagnoses
    assert found.name == "weak link"
    shown = diagnoses(flight)
    assert f'data-at="{found.t - flight.window.start:.3f}"' in shown
    assert found.remedy in shown


def test_maps_show_what_was_seen_of_the_floor(tmp_path):
    plan = synthetic.flight_plan(duration=6.0, robots=2, footprint="{type: cone, slope: 0.4}")
    synthetic.write_flight(tmp_path / "flight.mcap", plan, lag=0.0, noise=0.0)
    analysis = analyse(read_log(tmp_path / "flight.mcap"))
    maps = maps_data(analysis)
    assert maps["planar"]
    off = np.array(maps["seen"]["c"][-1]) - maps["phi"]
    assert np.sum(maps["weights"] * off**2) == pytest.approx(analysis.coverage.flown.ergodicity, rel=1e-2)
    assert playback_data(analysis)["sees"] == [{"type": "cone", "slope": 0.4, "rim": 1.0, "tilts": False}] * 2


def test_maps_of_where_robots_were_are_left_to_the_page(flight):
    assert maps_data(flight)["seen"] is None
    assert playback_data(flight)["sees"] == []
