"""Contact intervals and the policies' checks: on polynomials with known motion."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.connectivity import (
    AllTimeConnectivity,
    GuaranteedConnectivity,
    PairThreshold,
    PeriodicConnectivity,
    ProbabilisticConnectivity,
    SimultaneousConnectivity,
)
from missions.schema import Flight, Horizon, Limits, Mission, MissionSource, Robot, UniformMap, Workspace
from planner.certificate.certify import certify
from planner.certificate.connectivity import first_disconnection
from planner.certificate.contacts import RESOLUTION, contacts_within, time_in_contact
from planner.certificate.segments import common_segments
from planner.connectivity.forwarding import Contact
from planner.trajectory.bezier import power_coefficients
from planner.trajectory.encode import encode
from planner.trajectory.piecewise import PiecewisePolynomial

SECONDS = 10.0


def wanderer(seed, pieces=3):
    """A smooth walk through a box of 2 m; not at rest at its ends, which contacts do not mind."""
    rng = np.random.default_rng(seed)
    points = np.zeros((pieces, 4, 8))
    points[:, :3] = rng.uniform(-1.0, 1.0, (pieces, 3, 8))
    durations = np.full(pieces, SECONDS / pieces)
    return PiecewisePolynomial(durations, power_coefficients(points, durations))


@settings(deadline=None, max_examples=50)
@given(st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1), st.floats(0.2, 2.0))
def test_contacts_are_where_samples_say(a, b, reach):
    flown = [wanderer(a), wanderer(b)]
    contacts = contacts_within(common_segments(flown, np.array([0.0, SECONDS])), reach)
    t = np.linspace(0.0, SECONDS, 4001)
    distance = np.linalg.norm(flown[0].evaluate(t)[:, :3] - flown[1].evaluate(t)[:, :3], axis=1)
    inside = np.zeros(len(t), dtype=bool)
    near_edge = np.zeros(len(t), dtype=bool)
    for contact in contacts:
        inside |= (t >= contact.begin) & (t <= contact.end)
        near_edge |= np.minimum(np.abs(t - contact.begin), np.abs(t - contact.end)) <= 2.0 * RESOLUTION
    assert (distance[inside] <= reach + 1e-12).all(), "never too long"
    decided = ~near_edge & (np.abs(distance - reach) > 1e-6)
    assert (inside == (distance <= reach))[decided].all()
    assert all(x.end < y.begin for x, y in itertools.pairwise(contacts)), "apart and in order"


# ------------------------------------------------------------------------------------------- robots on a schedule


def shuttle(start, stops):
    """At rest at ``start``, then at each stop (x, y) at the end of equal pieces; in between along straight lines."""
    where = np.array([start, *stops])
    profile = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0])
    points = np.zeros((len(stops), 4, 8))
    points[:, :2] = where[:-1, :, None] + (where[1:] - where[:-1])[:, :, None] * profile
    points[:, 2] = 0.6
    durations = np.full(len(stops), SECONDS / len(stops))
    return PiecewisePolynomial(durations, power_coefficients(points, durations))


STARTS = {"a": (0.0, 0.0), "b": (1.0, 0.0), "c": (2.0, 0.0)}


def mission(policy):
    return Mission(
        schema_version=1,
        name="schedule",
        workspace=Workspace((-1.0, -1.0), (3.0, 1.0)),
        horizon=Horizon(SECONDS, 0.1),
        information=UniformMap(),
        robots=tuple(Robot(name, start) for name, start in STARTS.items()),
        limits=Limits(acceleration=1.0, speed=1.5, separation=0.2),
        connectivity=policy,
        flight=Flight(altitude=0.6),
        source=MissionSource("m.yaml", "a mission", {}),
    )


def by_turns():
    """b visits a (within 0.4 m from 2.5 s to 5 s or so), then c, which it reaches at the end; a stays, c stays."""
    return {
        "a": encode(shuttle(STARTS["a"], [STARTS["a"]] * 4)),
        "b": encode(shuttle(STARTS["b"], [(0.4, 0.0), (0.4, 0.0), (1.6, 0.0), (1.6, 0.0)])),
        "c": encode(shuttle(STARTS["c"], [STARTS["c"]] * 4)),
    }


def check(policy):
    (found,) = (
        item
        for item in certify(mission(policy), by_turns()).checks
        if item.name in ("same-time connection probability", "rendezvous", "contact at all times", "contact")
    )
    return found


def test_indicators_know_contacts_and_who_has_whose_data_when():
    found = certify(mission(PeriodicConnectivity(range=0.41)), by_turns()).indicators
    contacts = {pair.robots: pair.contacts for pair in found.pairs}
    (ab,), (bc,) = contacts["a", "b"], contacts["b", "c"]
    assert contacts["a", "c"] == ()
    assert 1.5 < ab[0] < 2.5 < 5.0 < ab[1] < 6.0
    assert 6.5 < bc[0] < 7.5
    assert bc[1] == pytest.approx(SECONDS)
    assert found.arrivals[0] == (0.0, ab[0], bc[0])
    assert found.arrivals[2] == (np.inf, bc[0], 0.0)
    shares = [pair.connected_share for pair in found.pairs]
    assert shares[0] == pytest.approx((ab[1] - ab[0]) / SECONDS)
    assert found.connected_share == pytest.approx(np.mean(shares))


@pytest.mark.parametrize(
    ("pairs", "instants", "value", "where", "time", "passed"),
    [
        ((("a", "b"),), (2.5, 5.0), 0.4, "a–b", None, True),
        ((("a", "b"), ("b", "c")), (2.5,), 1.6, "b–c", 2.5, False),
        ((("b", "c"),), (7.5,), 0.4, "b–c", 7.5, True),
    ],
)
def test_rendezvous(pairs, instants, value, where, time, passed):
    found = check(PeriodicConnectivity(range=0.5, pairs=pairs, instants=instants))
    assert (found.name, found.where, found.passed) == ("rendezvous", where, passed)
    assert found.value == pytest.approx(value, abs=1e-3)
    assert time is None or found.time == pytest.approx(time)


def test_rendezvous_of_a_connected_graph_needs_a_tree_only():
    policy = PeriodicConnectivity(range=0.7, instants=(5.0,))
    assert check(policy).value == pytest.approx(2.0, abs=1e-3)
    found = check(dataclasses.replace(policy, graph="connected"))
    assert (found.where, found.passed) == ("b–c", False)
    assert found.value == pytest.approx(1.6, abs=1e-3)


def test_contact_at_all_times_is_the_largest_distance():
    every = check(AllTimeConnectivity(range=1.7, pairs="chain"))
    assert every.passed
    assert every.value == pytest.approx(1.6, abs=2e-4)
    # A graph needs one of a-b and b-c short while the other is long, and a-c is never shorter than 2 m.
    tree = check(AllTimeConnectivity(range=1.5, graph="connected"))
    assert not tree.passed
    assert tree.value == pytest.approx(1.6, abs=3e-4)
    assert check(AllTimeConnectivity(range=1.61, graph="connected")).passed


def test_contact_times_are_those_of_the_intervals():
    policy = GuaranteedConnectivity(range=0.41, duration=2.0, pairs="chain", boundaries=(6.0,))
    ab = certify(mission(policy), by_turns()).indicators.pairs[0].contacts[0]
    only = dataclasses.replace(policy, pairs=(("a", "b"),), boundaries=())
    assert check(only).passed
    assert check(only).value == pytest.approx(ab[1] - ab[0], abs=2.0 * RESOLUTION)
    found = check(dataclasses.replace(only, boundaries=(6.0,)))
    assert (found.value, found.where, found.passed) == (0.0, "a–b, sub-period 2", False)
    assert not check(dataclasses.replace(only, duration=ab[1] - ab[0] + 2e-3)).passed


def test_contacts_sum_up_only_where_that_is_asked_for():
    contacts = [Contact(0, 1, 0.0, 1.0), Contact(0, 1, 2.0, 3.5)]
    assert time_in_contact(contacts, 0.0, 10.0) == (1.5, 2.5)
    assert time_in_contact(contacts, 0.5, 3.0) == (1.0, 1.5)
    assert time_in_contact([], 0.0, 1.0) == (0.0, 0.0)


def test_same_time_probability_is_checked_against_each_pairs_threshold():
    policy = SimultaneousConnectivity(range=0.5, threshold=0.01, pairs="chain", indicator="sigmoid", steepness=10.0)
    low = check(policy)
    assert low.passed
    strict = dataclasses.replace(policy, thresholds=(PairThreshold(pair=("c", "b"), threshold=0.9),))
    found = check(strict)
    assert (found.where, found.limit, found.passed) == ("b–c, sub-period 1", 0.9, False)


def test_a_connected_graph_of_probabilities_takes_the_best_tree():
    policy = ProbabilisticConnectivity(range=0.5, threshold=0.15)
    names = ("connection probability", "meeting")

    def failed(policy):
        return {item.name for item in certify(mission(policy), by_turns()).checks if item.name in names} & {
            item.name for item in certify(mission(policy), by_turns()).checks if not item.passed
        }

    assert failed(policy) == set(names)  # a and c never meet
    assert failed(dataclasses.replace(policy, graph="connected")) == set()


def test_disconnections_are_found_at_their_beginning():
    chain = [Contact(0, 1, 0.0, 10.0), Contact(1, 2, 0.0, 4.0), Contact(0, 2, 3.0, 10.0)]
    assert first_disconnection(3, chain, 10.0) is None
    assert first_disconnection(3, [*chain[:2], Contact(0, 2, 5.0, 10.0)], 10.0) == 4.0
