"""The object in reports: who saw what of it, when, and what the page draws."""

from __future__ import annotations

import base64
import dataclasses

import numpy as np
import pytest

from deploy.analysis import analyse
from deploy.flightlog.reader import read_log
from deploy.report import build_report
from deploy.report.maps import maps_data
from deploy.report.playback import playback_data, stage_data
from deploy.report.thing import thing_table
from planner.surface.mission import surface_of
from planner.surface.seen import seen_surface
from tests.deploy import synthetic_flight as synthetic
from tests.planner.objects_bench import BOX, read, text

FIXED = "trajectory: {yaw: {type: fixed, angle: 0.0}}\n"  # as the synthetic drones look


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Two drones that look along x: one flies past behind the object and sees it, one in front of it sees nothing."""
    plan = synthetic.flight_plan(
        asked=read(BOX, text(item="samples: 100").replace("duration: 10.0", "duration: 6.0") + FIXED)
    )
    path = tmp_path_factory.mktemp("log") / "flight.mcap"
    synthetic.write_flight(path, plan, lag=0.0, noise=0.0)
    return analyse(read_log(path))


def unpack(packed):
    steps = np.frombuffer(base64.b64decode(packed["data"]), "<u2").astype(float)
    steps[steps == 65535] = np.nan
    return packed["lo"] + steps * (packed["hi"] - packed["lo"]) / 65534


def test_what_is_seen_is_seen_from_where_robots_were_and_as_they_looked(flown):
    seen, mission = flown.sights, flown.flight_plan.mission
    asked = seen_surface(mission, flown.flight_plan.plan.q[:-1])
    assert 0.05 < asked.fraction < 0.9
    assert seen.fractions[0] == 0.0
    assert seen.fraction == pytest.approx(asked.fraction, abs=0.05)
    assert flown.summary()["information_seen"] == seen.fraction


def test_the_page_knows_the_surface_and_when_each_point_was_first_seen(flown):
    thing, surface = playback_data(flown)["thing"], surface_of(flown.flight_plan.mission)
    np.testing.assert_allclose(unpack(thing["points"]).reshape(-1, 3), surface.points, atol=1e-4)
    first = unpack(thing["first"]).reshape(2, -1)
    np.testing.assert_array_equal(np.isfinite(first), np.isfinite(flown.sights.first))
    np.testing.assert_allclose(first[1], np.where(np.isfinite(first[1]), flown.sights.first[1], np.nan), atol=1e-3)
    assert playback_data(flown)["obstacles"] == []  # the object is drawn as it is, not as what it is in the way of
    assert stage_data(flown.flight_plan.mission)["thing"]["first"] is None
    assert stage_data(synthetic.mission())["thing"] is None


def test_maps_are_those_of_the_surface_from_above(flown):
    maps, surface = maps_data(flown), surface_of(flown.flight_plan.mission)
    np.testing.assert_allclose([maps["lower"], maps["upper"]], [surface.lower[:2], surface.upper[:2]], atol=0.01)
    assert len(maps["seen"]["c"][0]) == len(maps["phi"]) == maps["functions"] ** 2
    assert maps["phi"][0] == pytest.approx(1.0)
    assert maps["given"]["width"] > 2
    assert not maps["planar"]


def test_the_table_tells_by_robot_and_together(flown):
    told = thing_table(flown)
    assert "together" in told
    assert f"{100.0 * flown.sights.fractions[1]:.1f}" in told
    assert told in build_report(flown)
    unsearched = dataclasses.replace(flown, window=None)
    assert unsearched.sights is None
    assert "–" in thing_table(unsearched)
