"""Dominance and hyper-volume: the laws they obey, and an estimate that shares no code with them."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from planner.pareto.dominance import dominates, non_dominated
from planner.pareto.hypervolume import exclusive, hypervolume

COARSE = st.integers(0, 4).map(lambda i: i / 4.0)  # ties on purpose


def vectors(m, most=8):
    return st.integers(1, most).flatmap(lambda n: arrays(np.float64, (n, m), elements=COARSE))


@given(st.integers(1, 4).flatmap(lambda m: arrays(np.float64, (3, m), elements=COARSE)))
def test_dominance_is_a_strict_partial_order(abc):
    a, b, c = abc
    assert not dominates(a, a)
    assert not (dominates(a, b) and dominates(b, a))
    assert not (dominates(a, b) and dominates(b, c)) or dominates(a, c)


@given(st.integers(1, 4).flatmap(vectors))
def test_whoever_is_kept_is_not_dominated_and_whoever_is_not_is_matched(points):
    keep = non_dominated(points)
    for i, j in itertools.product(range(len(points)), repeat=2):
        assert not (keep[j] and dominates(points[i], points[j]))
    for point in points[~keep]:
        assert any(dominates(other, point) or np.array_equal(other, point) for other in points[keep])


@pytest.mark.parametrize("m", [2, 3, 4, 5])
def test_hypervolume_is_what_monte_carlo_counts(m):
    rng = np.random.default_rng(m)
    points = rng.random((12, m)) * 1.2  # some beyond the reference
    samples = rng.random((40_000, m))
    hit = np.zeros(len(samples), dtype=bool)
    for point in points:
        hit |= (point <= samples).all(axis=1)
    error = np.sqrt(hit.mean() * (1 - hit.mean()) / len(samples))
    assert hypervolume(points) == pytest.approx(hit.mean(), abs=4 * error)


@given(st.integers(1, 4).flatmap(lambda m: vectors(m, 6)))
@settings(max_examples=60)
def test_hypervolume_by_inclusion_and_exclusion(points):
    total = 0.0
    for size in range(1, len(points) + 1):
        for some in itertools.combinations(points, size):
            total -= (-1) ** size * np.prod(1.0 - np.max(some, axis=0))
    assert hypervolume(points) == pytest.approx(total, abs=1e-12)


@given(vectors(3), arrays(np.float64, 3, elements=COARSE), st.randoms())
def test_hypervolume_grows_by_what_is_exclusive_whatever_the_order(points, point, random):
    grown = [*points, point]
    random.shuffle(grown)
    more = hypervolume(np.array(grown)) - hypervolume(points)
    assert more == pytest.approx(exclusive(point, points), abs=1e-12)
    assert more >= -1e-12


def test_the_reference_is_where_volume_ends():
    assert hypervolume(np.array([[0.25, 0.5]])) == 0.375
    assert hypervolume(np.array([[0.25, 0.5]]), np.array([2.0, 1.0])) == 0.875
    assert hypervolume(np.array([[0.25, 1.5], [1.0, 0.0]])) == 0.0
    assert hypervolume(np.empty((0, 2))) == 0.0
