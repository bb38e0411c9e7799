import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mocap.tracking.assignment import assign

costs = st.one_of(st.floats(-20.0, -0.01), st.just(math.inf))
matrices = st.integers(1, 4).flatmap(
    lambda n: st.integers(1, 4).flatmap(
        lambda m: st.lists(st.lists(costs, min_size=m, max_size=m), min_size=n, max_size=n)
    )
)


def every_assignment(cost):
    """All of them, as {row: column}."""
    n, m = cost.shape
    for columns in itertools.product([None, *range(m)], repeat=n):
        taken = [column for column in columns if column is not None]
        if len(set(taken)) == len(taken) and all(cost[i, j] < math.inf for i, j in enumerate(columns) if j is not None):
            yield {i: j for i, j in enumerate(columns) if j is not None}


def total(cost, assignment):
    return sum(cost[i, j] for i, j in assignment.items())


@settings(max_examples=120, deadline=None)
@given(matrices)
def test_nothing_is_cheaper_and_margins_are_those_of_the_next_best(rows):
    cost = np.array(rows)
    matches = assign(cost)
    best = {match.row: match.column for match in matches}
    everything = list(every_assignment(cost))
    least = min(total(cost, a) for a in everything)
    assert total(cost, best) == pytest.approx(least, abs=1e-9)
    for match in matches:
        given_away = [
            total(cost, a) for a in everything if any(j == match.column and i != match.row for i, j in a.items())
        ]
        elsewhere = [total(cost, a) for a in everything if a.get(match.row, match.column) != match.column]
        assert match.contested == pytest.approx(min(given_away, default=math.inf) - least, abs=1e-9)
        assert match.mistaken == pytest.approx(min(elsewhere, default=math.inf) - least, abs=1e-9)


@pytest.mark.parametrize("shape", [(30, 30), (12, 40), (40, 12)])
def test_large_problems_agree_with_scipy(shape):
    from scipy.optimize import linear_sum_assignment

    cost = -np.random.default_rng(1).uniform(0.1, 10.0, shape)
    rows, columns = linear_sum_assignment(cost)
    assert sum(cost[m.row, m.column] for m in assign(cost)) == pytest.approx(cost[rows, columns].sum())


def test_pairs_that_cost_more_than_nothing_are_not_made():
    assert assign(np.array([[1.0, math.inf], [math.inf, 0.0]])) == []
    assert assign(np.empty((2, 0))) == []
