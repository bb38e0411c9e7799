"""Who flies from which start where the mission leaves it open."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.assignment import assigned
from missions.errors import MissionError
from missions.loader import parse_mission
from missions.obstacles import KeepInZone
from missions.schema import Flight, Horizon, Limits, Mission, Robot, RobotLimits, UniformMap, Workspace

TEXT = """\
schema_version: 1
name: crossed
workspace: {lower: [0.0, 0.0], upper: [4.0, 3.0]}
horizon: {duration: 10.0}
information: {type: uniform}
limits: {acceleration: 0.5}
robots:
  - {name: a, start: [3.5, 2.0], pad: [0.5, 0.2], end: start}
  - {name: b, start: [2.0, 2.0], pad: [2.0, 0.2], end: [2.5, 2.5]}
  - {name: c, start: [0.5, 2.0], pad: [3.5, 0.2]}
flight: {assignment: cheapest}
"""


def read(text):
    return parse_mission(text, path="m.yaml", read_file={}.__getitem__)


def mission(pads, starts, **changes):
    robots = tuple(Robot(f"r{i}", tuple(s), pad=tuple(p)) for i, (s, p) in enumerate(zip(starts, pads, strict=True)))
    base = Mission(
        schema_version=1,
        name="m",
        workspace=Workspace((-10.0, -10.0), (10.0, 10.0)),
        horizon=Horizon(10.0, 0.1),
        information=UniformMap(),
        robots=robots,
        limits=Limits(acceleration=0.5),
        flight=Flight(assignment="cheapest"),
    )
    return dataclasses.replace(base, **changes)


def cost(of):
    return sum(float(np.sum(np.square(np.subtract(r.pad, r.start)))) for r in of.robots)


def test_starts_go_to_whom_they_are_near_with_what_belongs_to_them():
    a, b, c = read(TEXT).robots
    assert [robot.start for robot in (a, b, c)] == [(0.5, 2.0), (2.0, 2.0), (3.5, 2.0)]
    assert (a.end, b.end, c.end) == (None, (2.5, 2.5), "start")
    assert [robot.pad for robot in (a, b, c)] == [(0.5, 0.2), (2.0, 0.2), (3.5, 0.2)]
    fixed = read(TEXT.replace("cheapest", "fixed"))
    assert [robot.start for robot in fixed.robots] == [(3.5, 2.0), (2.0, 2.0), (0.5, 2.0)]
    assert read(TEXT).source.sha256 != fixed.source.sha256


points = st.lists(st.tuples(*[st.floats(-9.0, 9.0)] * 2), min_size=4, max_size=4)


@given(points, points)
@settings(deadline=None, max_examples=60)
def test_no_other_assignment_is_cheaper(pads, starts):
    best = assigned(mission(pads, starts))
    assert sorted(r.start for r in best.robots) == sorted(map(tuple, starts))
    for order in itertools.permutations(starts):
        assert cost(best) <= cost(mission(pads, order)) + 1e-6


def test_nobody_moves_without_need():
    """Pads under the starts, or ties: as it is written."""
    plain = mission([(0.0, 0.0), (1.0, 0.0)], [(0.0, 0.0), (1.0, 0.0)])
    assert assigned(plain) == plain
    tie = mission([(0.0, 0.0), (0.0, 2.0)], [(1.0, 1.0), (-1.0, 1.0)])
    assert assigned(tie) == tie
    bare = dataclasses.replace(plain, robots=tuple(dataclasses.replace(r, pad=None) for r in plain.robots))
    assert [r.start for r in assigned(bare).robots] == [r.start for r in plain.robots]


@pytest.mark.parametrize("own", [{"limits": RobotLimits(speed=0.5)}, {"altitude": 1.0}, {"zone": True}])
def test_only_robots_that_may_do_the_same_exchange(own):
    crossed = mission([(0.0, 0.0), (4.0, 0.0), (8.0, 0.0)], [(4.0, 1.0), (0.0, 1.0), (8.0, 1.0)])
    zones = ()
    if own.pop("zone", False):
        zones = (KeepInZone(((-9.0, -9.0), (9.0, -9.0), (0.0, 9.0)), robots=("r0",)),)
    robots = (dataclasses.replace(crossed.robots[0], **own), *crossed.robots[1:])
    kept = assigned(dataclasses.replace(crossed, robots=robots, zones=zones))
    assert [r.start for r in kept.robots] == [r.start for r in crossed.robots]
    assert assigned(crossed).robots[0].start == (0.0, 1.0)


def test_a_pad_that_was_under_its_start_stays_where_it_was():
    crossed = mission([(0.0, 0.0), (9.0, 9.0)], [(4.0, 0.5), (0.5, 0.0)])
    robots = (crossed.robots[0], dataclasses.replace(crossed.robots[1], pad=None))
    one, two = assigned(dataclasses.replace(crossed, robots=robots)).robots
    assert (one.pad, one.start) == ((0.0, 0.0), (0.5, 0.0))
    assert (two.pad, two.start) == ((0.5, 0.0), (4.0, 0.5))


@pytest.mark.parametrize(
    "policy",
    [
        "{policy: all_time, range: 2.0, pairs: chain}",
        "{policy: probabilistic, range: 1.0, sub_periods: 1, threshold: 0.05, "
        "thresholds: [{pair: [a, b], threshold: 0.1}]}",
    ],
)
def test_refused_where_meetings_depend_on_it(policy):
    with pytest.raises(MissionError, match=r"flight\.assignment: got cheapest, with pairs that depend on who starts"):
        read(TEXT + f"connectivity: {policy}\n")
