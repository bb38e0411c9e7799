import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.connectivity.pairs import all_pairs, sub_period_bounds
from planner.connectivity.probability import (
    cheaper_through_moments,
    connection_log_probability,
    connection_probability,
)
from planner.connectivity.quadrature import every_step, thinned
from tests.planner.problems import notebook

AUTHORS = notebook()
POSITIONS = np.array(AUTHORS["positions_by_step_robot"])
THIRDS = sub_period_bounds(300, 3)
PAIRS = all_pairs(4)


def test_the_authors_probabilities():
    P = connection_probability(POSITIONS, 0.5, PAIRS, every_step(THIRDS))
    assert PAIRS.tolist() == AUTHORS["pairs"]
    np.testing.assert_allclose(P, AUTHORS["P_by_pair_period"], rtol=0, atol=1e-9)


def test_it_is_the_plain_double_sum_also_for_unequal_sub_periods():
    rng = np.random.default_rng(0)
    q = rng.uniform(-1.0, 1.0, (11, 3, 3))
    bounds = sub_period_bounds(11, 3)
    P = connection_probability(q, 0.7, all_pairs(3), every_step(bounds))
    for row, (i, j) in enumerate(all_pairs(3)):
        for p, (a, b) in enumerate(bounds):
            d = np.linalg.norm(q[a:b, None, i] - q[None, a:b, j], axis=-1)
            assert P[row, p] == pytest.approx(np.exp(-(d**2) / (2 * 0.7**2)).mean(), rel=1e-12)


@pytest.mark.parametrize("stride", [2, 3])
def test_thinned_averages_follow_smooth_motion(stride):
    exact = connection_probability(POSITIONS, 0.5, PAIRS, every_step(THIRDS))
    fewer = connection_probability(POSITIONS, 0.5, PAIRS, thinned(THIRDS, stride))
    np.testing.assert_allclose(fewer, exact, rtol=5e-4)  # a twentieth of the margin on the threshold


@given(st.integers(4, 60), st.integers(1, 4), st.integers(1, 5))
@settings(max_examples=50, deadline=None)
def test_thinned_averages_are_exact_for_cubics(steps, sub_periods, stride):
    bounds = sub_period_bounds(steps, min(sub_periods, steps // 4))
    nodes, weights = thinned(bounds, stride)
    f = (np.arange(steps) / steps) ** 3 - 0.3 * np.arange(steps) / steps
    np.testing.assert_allclose((weights * f[nodes]).sum(axis=1), [f[a:b].mean() for a, b in bounds], atol=1e-10)


def test_robots_in_one_place_are_connected_for_sure():
    q = np.full((6, 2, 2), 3.0)
    np.testing.assert_allclose(connection_probability(q, 0.2, all_pairs(2), every_step(((0, 6),))), 1.0)


def test_the_logarithm_pulls_from_any_distance():
    q = np.zeros((10, 2, 2))
    q[:, 1, 0] = 1000.0
    value = connection_log_probability(q, 0.5, all_pairs(2), every_step(((0, 10),)))
    assert value.log_P[0, 0] == pytest.approx(-(1000.0**2) / (2 * 0.5**2))
    pull = value.pull(np.ones((1, 1)))
    assert (pull[:, 0, 0] > 0.0).all()
    assert (pull[:, 1, 0] < 0.0).all()


class TestMoments:
    """Where it is cheaper, P comes through moments; nothing but the time may tell."""

    def wander(self, side, robots=40):
        steps = np.random.default_rng(2).standard_normal((120, robots, 2)).cumsum(axis=0)
        return side * (steps - steps.min()) / np.ptp(steps)

    @pytest.mark.parametrize("side", [0.8, 3.0, 12.0])
    def test_they_agree_with_the_double_sum_near_and_far(self, side):
        q, pairs, quadrature = self.wander(side), all_pairs(40), every_step(((0, 60), (60, 110)))
        assert cheaper_through_moments(q[quadrature.nodes].transpose(2, 0, 1, 3) / 0.5, len(pairs))
        fast = connection_log_probability(q, 0.5, pairs, quadrature)
        exact = connection_log_probability(q, 0.5, pairs, quadrature, exact=True)
        np.testing.assert_allclose(fast.log_P, exact.log_P, atol=1e-4)
        weights = np.random.default_rng(3).standard_normal(exact.log_P.shape)
        slope = exact.pull(weights)
        np.testing.assert_allclose(fast.pull(weights), slope, atol=1e-4 * np.abs(slope).max())

    def test_they_take_pairs_in_any_number_and_order(self):
        q, quadrature = self.wander(3.0), every_step(((0, 120),))
        everyone = all_pairs(40)
        some = everyone[::2][::-1, ::-1]
        fast = connection_log_probability(q, 0.5, everyone, quadrature).log_P
        np.testing.assert_allclose(
            connection_log_probability(q, 0.5, some, quadrature, exact=True).log_P, fast[::2][::-1], atol=1e-5
        )

    def test_few_pairs_and_three_axes_are_summed_directly(self):
        w = np.zeros((2, 1, 40, 3))
        assert not cheaper_through_moments(w, 1)
        assert not cheaper_through_moments(w[..., :2], 1)


@given(st.integers(1, 500), st.integers(1, 9))
def test_sub_periods_tile_the_horizon(steps, sub_periods):
    if sub_periods > steps:
        with pytest.raises(ValueError, match="cannot be divided"):
            sub_period_bounds(steps, sub_periods)
        return
    bounds = sub_period_bounds(steps, sub_periods)
    assert [step for a, b in bounds for step in range(a, b)] == list(range(steps))
    lengths = [b - a for a, b in bounds]
    assert max(lengths) - min(lengths) <= 1
