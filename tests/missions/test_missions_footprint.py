"""Footprints in mission files: what is read, what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from missions.errors import MissionError
from missions.footprint import ConeFootprint
from missions.loader import parse_mission
from planner.footprint.metric import FootprintMetric
from planner.indicators import ergodic_metric
from planner.pareto.front import Maps

MISSION = """
schema_version: 1
name: looks_down
workspace: {lower: [0, 0, 0.3], upper: [3, 3, 1.5]}
horizon: {duration: 10}
footprint: {FOOTPRINT}
information: {type: gaussians, components: [{mean: [MEAN], covariance: 0.1}]}
robots: [{name: cf1, start: [1.5, 1.5, 0.6]}]
limits: {acceleration: 1.0}
"""


def read(footprint: str, mean: str = "1.0, 1.0"):
    return parse_mission(MISSION.replace("FOOTPRINT", footprint).replace("MEAN", mean), path="m.yaml", read_file=bytes)


def test_information_is_on_the_floor_below_a_search_in_three_dimensions():
    mission = read("type: cone, slope: 0.4")
    assert mission.footprint == ConeFootprint(0.4)
    assert (mission.dimension, mission.information_axes) == (3, 2)
    metric = ergodic_metric(mission)
    assert isinstance(metric, FootprintMetric)
    assert metric.phi_k.shape == (10, 10)


@pytest.mark.parametrize(
    "footprint",
    [
        "type: point",
        "type: disc, radius: 0.2, rim: 0.5",
        "type: cone, slope: 0.4, tilts: true",
        "type: window, slopes: [0.4, 0.3]",
        "type: window, slopes: [0.4, 0.3], yaw: 0.5",
    ],
)
def test_every_kind_has_a_metric(footprint):
    hover = np.tile(np.array([1.5, 1.5, 0.6]), (100, 1, 1))
    assert ergodic_metric(read(footprint)).value(hover) > 0.0


@pytest.mark.parametrize(
    ("footprint", "says"),
    [
        ("type: cone", "footprint: missing key 'slope'"),
        ("type: cone, slope: 0", "footprint.slope: got 0; allowed: above 0"),
        ("type: disc, radius: 0.2, rim: 1.5", "footprint.rim: got 1.5; allowed"),
        ("type: window, slopes: [0.4]", "footprint.slopes: got 1"),
        ("type: oval, slope: 1", "footprint.type: "),
    ],
)
def test_footprints_that_are_refused(footprint, says):
    with pytest.raises(MissionError) as caught:
        read(footprint)
    assert says in str(caught.value)


def test_information_in_the_air_is_refused_where_the_floor_is_looked_at():
    with pytest.raises(MissionError, match=r"components\[0\]\.mean: got 3 numbers; allowed: 2, as the floor"):
        read("type: point", "1.0, 1.0, 0.5")


def test_maps_of_the_floor_are_told_apart_as_they_are_looked_at():
    mission = read("type: cone, slope: 0.4")
    hover = np.tile(np.array([1.5, 1.5, 0.6]), (100, 1, 1))
    assert Maps.of(mission).vector(hover) == pytest.approx([ergodic_metric(mission).value(hover)])


def two(own: str, whose: str = "{type: disc, radius: 0.2}"):
    text = MISSION.replace("{FOOTPRINT}", whose).replace("MEAN", "1.0, 1.0")
    robots = "[{name: cf1, start: [1.0, 1.5, 0.6]}, {name: cf2, start: [2.0, 1.5, 0.6], footprint: OWN}]"
    text = text.replace("[{name: cf1, start: [1.5, 1.5, 0.6]}]", robots.replace("OWN", own))
    return parse_mission(text, path="m.yaml", read_file=bytes)


def test_a_robot_may_see_what_others_do_not():
    mission = two("{type: cone, slope: 0.4}")
    metric, q = ergodic_metric(mission), np.tile(np.array([[1.0, 1.5, 0.6], [2.0, 1.5, 0.6]]), (100, 1, 1))
    assert [footprint.type for footprint in mission.footprints] == ["disc", "cone"]
    alone = [read("type: disc, radius: 0.2"), read("type: cone, slope: 0.4")]
    seen = [ergodic_metric(mission).statistics(q[:, [i]]) for i, mission in enumerate(alone)]
    np.testing.assert_allclose(metric.statistics(q), 0.5 * (seen[0] + seen[1]), atol=1e-12)


def test_a_robot_sees_the_floor_only_where_the_mission_is_about_the_floor():
    with pytest.raises(
        MissionError, match=r"m.yaml:.*: robots\[1\].footprint: got a robot's own where the mission has"
    ):
        two("{type: cone, slope: 0.4}", whose="null")
