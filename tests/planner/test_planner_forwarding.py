"""Store and forward: earliest arrivals against a simulation that knows only instants."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.topology import components
from planner.connectivity.forwarding import Contact, arrival_tables, earliest_arrivals, sampled_contacts

HORIZON = 12


@st.composite
def schedules(draw):
    """Robots and contacts between whole seconds."""
    robots = draw(st.integers(1, 6))
    pairs = list(itertools.combinations(range(robots), 2))
    contacts = []
    if pairs:
        for i, j in draw(st.lists(st.sampled_from(pairs), max_size=12)):
            begin = draw(st.integers(0, HORIZON))
            contacts.append(Contact(i, j, begin, draw(st.integers(begin, HORIZON))))
    return robots, contacts


def flooded(robots, contacts, start=0, end=HORIZON):
    """At every whole second, everybody who is connected shares everything: nothing changes in between."""
    arrival = np.full((robots, robots), np.inf)
    knows = [{i} for i in range(robots)]
    for t in range(start, end + 1):
        touching = [(c.i, c.j) for c in contacts if c.begin <= t <= c.end]
        for group in components(robots, touching):
            together = set().union(*(knows[robot] for robot in group))
            for robot in group:
                knows[robot] = set(together)
        for robot, message in itertools.product(range(robots), repeat=2):
            if message in knows[robot]:
                arrival[message, robot] = min(arrival[message, robot], t)
    return arrival


@given(schedules())
def test_arrivals_are_those_of_a_simulation(schedule):
    robots, contacts = schedule
    np.testing.assert_array_equal(earliest_arrivals(robots, contacts), flooded(robots, contacts))


@given(schedules(), st.integers(0, HORIZON), st.integers(0, HORIZON))
def test_only_contacts_of_the_span_count(schedule, a, b):
    robots, contacts = schedule
    start, end = min(a, b), max(a, b)
    found = earliest_arrivals(robots, contacts, float(start), float(end))
    np.testing.assert_array_equal(found, flooded(robots, contacts, start, end))


@given(schedules())
def test_more_contacts_never_delay(schedule):
    robots, contacts = schedule
    fewer = earliest_arrivals(robots, contacts[:-1])
    assert (earliest_arrivals(robots, contacts) <= fewer).all()


def test_order_matters():
    """a meets b, then b meets c: a's data reach c, c's never reach a."""
    contacts = [Contact(1, 2, 5.0, 6.0), Contact(0, 1, 1.0, 2.0)]
    arrival = earliest_arrivals(3, contacts)
    assert arrival[0, 2] == 5.0
    assert math.isinf(arrival[2, 0])
    assert arrival[1, 0] == 1.0
    # In the second half only b and c exchange, from the moment they meet.
    whole, (first, second) = arrival_tables(3, contacts, (0.0, 4.0, 8.0))
    assert whole == tuple(map(tuple, arrival))
    assert math.isinf(first[0][2])
    assert second[1] == (math.inf, 4.0, 5.0)


def test_a_chain_of_overlapping_contacts_passes_on_at_once():
    contacts = [Contact(2, 3, 0.0, 9.0), Contact(1, 2, 1.0, 9.0), Contact(0, 1, 3.0, 9.0)]
    assert earliest_arrivals(4, contacts)[0].tolist() == [0.0, 3.0, 3.0, 3.0]
    assert earliest_arrivals(4, contacts)[3].tolist() == [3.0, 1.0, 0.0, 0.0]


def test_contacts_of_samples_are_runs():
    t = np.array([0.0, 0.5, 1.0, 1.5])
    within = np.array([[True, False], [True, False], [False, False], [True, True]])
    assert sampled_contacts(t, within, [(0, 1), (0, 2)]) == [
        Contact(0, 1, 0.0, 0.5),
        Contact(0, 1, 1.5, 1.5),
        Contact(0, 2, 1.5, 1.5),
    ]


@pytest.mark.parametrize("robots", [1, 3])
def test_nobody_in_contact(robots):
    arrival = earliest_arrivals(robots, [], 2.0)
    assert (np.diag(arrival) == 2.0).all()
    assert np.isinf(arrival[~np.eye(robots, dtype=bool)]).all()
