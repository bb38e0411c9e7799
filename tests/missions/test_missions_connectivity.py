"""Connectivity in mission files: pairs, sub-periods, refusals, and what is out of reach."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import missions
from missions import MissionError, load_mission, parse_mission
from missions.connectivity import (
    AllTimeConnectivity,
    GuaranteedConnectivity,
    NoConnectivity,
    PairThreshold,
    PeriodicConnectivity,
    ProbabilisticConnectivity,
    SimultaneousConnectivity,
)
from missions.indicator import Indicator
from missions.reach import best_probability, reach, shortfall
from missions.topology import (
    pair_thresholds,
    policy_pairs,
    rendezvous_steps,
    sub_period_steps,
    sub_period_times,
)

FOLDER = Path(missions.__file__).parent
IMEC = load_mission(FOLDER / "imec_four_drones.yaml")
HEAD = (FOLDER / "imec_four_drones.yaml").read_text()
BEFORE, AFTER = HEAD.index("connectivity:\n"), HEAD.index("# What every drone may do")


def under(policy, **changes):
    return dataclasses.replace(IMEC, connectivity=policy, **changes)


def probabilistic(**changes):
    return ProbabilisticConnectivity(**{"range": 0.5, "threshold": 0.25, **changes})


# ---------------------------------------------------------------------------------------------- pairs, sub-periods


@pytest.mark.parametrize(
    ("chosen", "pairs"),
    [
        ({}, [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]),
        ({"pairs": "ring"}, [(0, 1), (0, 3), (1, 2), (2, 3)]),
        ({"pairs": "chain"}, [(0, 1), (1, 2), (2, 3)]),
        ({"pairs": "star", "hub": "cf3"}, [(0, 2), (1, 2), (2, 3)]),
        ({"pairs": (("cf4", "cf1"), ("cf2", "cf3"))}, [(0, 3), (1, 2)]),
    ],
)
def test_pairs(chosen, pairs):
    assert list(policy_pairs(under(probabilistic(**chosen)))) == pairs


def test_a_ring_of_two_or_one_has_no_pair_twice():
    two = under(probabilistic(pairs="ring"), robots=IMEC.robots[:2])
    assert policy_pairs(two) == ((0, 1),)
    assert policy_pairs(under(probabilistic(pairs="ring"), robots=IMEC.robots[:1])) == ()
    assert policy_pairs(under(NoConnectivity(range=0.5))) == ()


def test_thresholds_of_pairs_override():
    own = (PairThreshold(pair=("cf3", "cf2"), threshold=0.4),)
    assert pair_thresholds(under(probabilistic(pairs="chain", thresholds=own))) == (0.25, 0.4, 0.25)
    assert pair_thresholds(under(AllTimeConnectivity(range=0.5))) == ()


def test_sub_periods_are_equal_or_as_said():
    assert sub_period_steps(under(probabilistic(sub_periods=3))) == ((0, 100), (100, 200), (200, 300))
    unequal = under(PeriodicConnectivity(range=0.5, boundaries=(6.0, 20.1)))
    assert sub_period_steps(unequal) == ((0, 60), (60, 201), (201, 300))
    assert sub_period_times(unequal) == pytest.approx((0.0, 6.0, 20.1, 30.0))
    assert rendezvous_steps(unequal, unequal.connectivity) == (60, 201, 300)
    assert rendezvous_steps(unequal, PeriodicConnectivity(range=0.5, instants=(1.0, 2.5))) == (10, 25)
    assert sub_period_steps(under(AllTimeConnectivity(range=0.5))) == ((0, 300),)


# ------------------------------------------------------------------------------------------------------- refusals

POLICY = "connectivity:\n  policy: {}\n  range: 0.5\n"
PROBABILISTIC = POLICY.format("probabilistic") + "  threshold: 0.1\n"
GUARANTEED = POLICY.format("guaranteed")


@pytest.mark.parametrize(
    ("text", "refusal"),
    [
        (
            PROBABILISTIC + "  pairs: [[cf1, cf9]]\n",
            "pairs[0][1]: got 'cf9'; allowed: cf1, cf2, cf3, cf4 (did you mean",
        ),
        (PROBABILISTIC + "  pairs: [[cf1, cf2], [cf2, cf1]]\n", "pairs[1]: the same pair as pairs[0]"),
        (PROBABILISTIC + "  pairs: [[cf1, cf1]]\n", "pairs[0]: got 'cf1' twice; allowed: two robots"),
        (PROBABILISTIC + "  pairs: [[cf1, cf2, cf3]]\n", "pairs[0]: got 3 names; allowed: 2"),
        (PROBABILISTIC + "  pairs: circle\n", "pairs: got 'circle'; allowed: all, ring, chain, star"),
        (PROBABILISTIC + "  pairs: star\n", "hub: got ''; allowed: cf1, cf2, cf3, cf4"),
        (PROBABILISTIC + "  hub: cf1\n", "hub: a hub is for 'pairs: star' only"),
        (
            PROBABILISTIC + "  graph: connected\n  pairs: [[cf1, cf2], [cf3, cf4]]\n",
            "pairs: no chain of the pairs leads from cf1 to cf3",
        ),
        (
            PROBABILISTIC + "  pairs: chain\n  thresholds: [{pair: [cf1, cf3], threshold: 0.2}]\n",
            "thresholds[0].pair: got cf1-cf3; allowed: a pair that 'pairs' asks to connect",
        ),
        (
            PROBABILISTIC + "  thresholds: [{pair: [cf1, cf2], threshold: 0.2}, {pair: [cf2, cf1], threshold: 0.1}]\n",
            "thresholds[1].pair: the same pair as thresholds[0]",
        ),
        (PROBABILISTIC + "  sub_periods: 7\n", "sub_periods: got 7; allowed: a divisor of the 300 steps"),
        (PROBABILISTIC + "  boundaries: [10.05]\n", "boundaries[0]: got 10.05; allowed: a whole multiple of dt = 0.1"),
        (PROBABILISTIC + "  boundaries: [20.0, 10.0]\n", "boundaries[1]: got 10; allowed: above 20 [s], increasing"),
        (PROBABILISTIC + "  boundaries: [30.0]\n", "boundaries[0]: got 30; allowed: below the duration of 30 [s]"),
        (PROBABILISTIC + "  sub_periods: 3\n  boundaries: [10.0]\n", "sub_periods: got 3; 1 boundaries make 2"),
        (
            POLICY.format("periodic") + "  instants: [31.0]\n",
            "instants[0]: got 31; allowed: at most the duration of 30",
        ),
        (GUARANTEED + "  duration: 12\n  sub_periods: 3\n", "duration: got 12; allowed: at most 10 [s], the shortest"),
        (POLICY.format("all_time").replace("0.5", "0.3"), "range: got 0.3; allowed: above the separation of 0.3"),
    ],
)
def test_refusals(text, refusal):
    with pytest.raises(MissionError) as caught:
        parse_mission(HEAD[:BEFORE] + text + HEAD[AFTER:], path="m.yaml", read_file=bytes)
    assert f"connectivity.{refusal}" in str(caught.value)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("path", sorted((FOLDER / "policies").glob("*.yaml")), ids=lambda path: path.stem)
def test_shipped_policies_load_and_are_within_reach(path):
    mission = load_mission(path)
    assert mission.name == path.stem
    assert shortfall(mission) is None


# ---------------------------------------------------------------------------------------------------------- reach

# Three robots, of which the third starts 9 m away from the second and 10 m from the first.
FAR = dataclasses.replace(
    IMEC,
    workspace=dataclasses.replace(IMEC.workspace, upper=(12.0, 2.5)),
    robots=tuple(
        dataclasses.replace(robot, start=start)
        for robot, start in zip(IMEC.robots, ((0.5, 0.3), (1.5, 0.3), (10.5, 0.3)), strict=False)
    ),
    obstacles=(),
)


def meeting_time(distance, R):
    """When two robots that race towards each other come within range [s]."""
    a, v, half = 0.5 * math.sqrt(2.0), 1.0, 0.5 * (distance - R)
    return math.sqrt(2.0 * half / a) if half < 0.5 * v * v / a else half / v + 0.5 * v / a


@pytest.mark.parametrize(
    ("policy", "pair", "place"),
    [
        (PeriodicConnectivity(range=0.5, instants=(4.0, 30.0)), (0, 2), "at 4 s"),
        (PeriodicConnectivity(range=0.5, instants=(4.0, 30.0), graph="connected"), (1, 2), "at 4 s"),
        (PeriodicConnectivity(range=0.5, sub_periods=10, pairs="chain"), (1, 2), "at 3 s"),
        (AllTimeConnectivity(range=0.5), (0, 2), "at 0 s"),
        (AllTimeConnectivity(range=1.2, graph="connected"), (1, 2), "at 0 s"),
        (GuaranteedConnectivity(range=0.5, duration=1.0, boundaries=(5.5,)), (0, 2), "sub-period 1"),
        (GuaranteedConnectivity(range=0.5, duration=1.0, boundaries=(5.5,), graph="connected"), (1, 2), "sub-period 1"),
        (probabilistic(sub_periods=10), (0, 2), "sub-period 1"),
        (probabilistic(sub_periods=10, graph="connected"), (1, 2), "sub-period 1"),
        (SimultaneousConnectivity(range=0.5, threshold=0.3, sub_periods=6), (0, 2), "sub-period 1"),
    ],
)
def test_three_robots_that_cannot_meet_in_time(policy, pair, place):
    found = shortfall(dataclasses.replace(FAR, connectivity=policy))
    assert (found.pair, found.place) == (pair, place)
    assert found.required in (policy.range, getattr(policy, "threshold", None), getattr(policy, "duration", None))


@pytest.mark.parametrize("distance", [1.0, 3.0, 9.0])
def test_the_bound_of_a_contact_is_what_two_that_race_achieve(distance):
    earliest = meeting_time(distance, 0.5)
    two = dataclasses.replace(
        FAR, robots=(FAR.robots[0], dataclasses.replace(FAR.robots[1], start=(0.5 + distance, 0.3)))
    )
    for step in (-1, 0, 1):  # rendezvous one step too early, and just in time
        instant = (math.ceil(earliest / 0.1) + step) * 0.1
        found = shortfall(dataclasses.replace(two, connectivity=PeriodicConnectivity(range=0.5, instants=(instant,))))
        assert (found is None) == (instant >= earliest)
    for slack in (-1e-3, 1e-3):
        duration = 8.0 - earliest - slack
        policy = GuaranteedConnectivity(range=0.5, duration=duration, boundaries=(8.0,))
        found = shortfall(dataclasses.replace(two, connectivity=policy))
        assert (found is None) == (slack > 0.0)
        assert found is None or found.bound == pytest.approx(8.0 - earliest, abs=1e-6)


def test_the_fastest_robots_limits_bound_everybodys_reach():
    t = np.linspace(0.0, 10.0, 101)
    quick = dataclasses.replace(IMEC.robots[2], limits=dataclasses.replace(IMEC.robots[2].limits, speed=2.0))
    faster = dataclasses.replace(IMEC, robots=(*IMEC.robots[:2], quick))
    assert (reach(faster, t) >= reach(IMEC, t)).all()
    assert reach(faster, t)[-1] > reach(IMEC, t)[-1]


def test_layers_farther_apart_than_the_range_never_meet():
    low, high = (
        dataclasses.replace(IMEC.robots[k], start=(1.0 + 0.4 * k, 0.3), altitude=z) for k, z in ((0, 0.5), (1, 1.1))
    )
    mission = under(GuaranteedConnectivity(range=0.5, duration=1.0), robots=(low, high))
    found = shortfall(mission)
    assert (found.constraint, found.bound) == ("contact", 0.0)
    assert shortfall(dataclasses.replace(mission, connectivity=GuaranteedConnectivity(range=0.7, duration=1.0))) is None


def test_each_threshold_is_held_against_its_own_pairs():
    own = (PairThreshold(pair=("cf1", "cf2"), threshold=0.99),)
    policy = probabilistic(sub_periods=15, threshold=0.001, thresholds=own)
    found = shortfall(under(policy))
    assert (found.pair, found.required) == ((0, 1), 0.99)
    assert found.bound == pytest.approx(best_probability(under(policy), policy, (0, 1))[0])


# ------------------------------------------------------------------------------------------------------ indicator


@settings(deadline=None)
@given(st.sampled_from(["gaussian", "sigmoid"]), st.floats(0.1, 50.0), st.floats(0.0, 400.0))
def test_indicators_fall_with_distance_and_know_their_slope(shape, steepness, s):
    gamma = Indicator(shape, steepness)
    at = np.array([s])
    value, slope = gamma.log(at)
    assert value <= 0.0
    assert slope < 0.0
    step = 1e-6 * (1.0 + s)
    numeric = (gamma.log(at + step).value - gamma.log(at - step).value) / (2.0 * step)
    assert numeric == pytest.approx(slope, rel=1e-4, abs=1e-6)


def test_indicators_are_the_papers():
    distance = np.array([0.0, 0.5, 1.3])
    np.testing.assert_allclose(Indicator()(distance, 0.5), np.exp(-(distance**2) / 0.5))
    sigmoid = 1.0 / (1.0 + np.exp(3.0 * (distance**2 / 0.25 - 1.0)))
    np.testing.assert_allclose(Indicator("sigmoid", 3.0)(distance, 0.5), sigmoid)
