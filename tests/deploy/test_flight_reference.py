"""Where robots should be at single times: the same as what was certified."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from deploy.flight.courses import Courses
from deploy.flight.reference import Reference, Way
from planner.trajectory.piecewise import PiecewisePolynomial
from tests.deploy.flight_bench import small_plan

DURATIONS = np.array([0.5, 1.25, 0.75])
TRAJECTORY = PiecewisePolynomial(DURATIONS, np.random.default_rng(4).normal(size=(3, 4, 8)))
KNOTS = TRAJECTORY.knots().tolist()


@given(st.floats(-1.0, 4.0) | st.sampled_from(KNOTS))
def test_single_times_give_what_the_arrays_give(t):
    reference = Reference(TRAJECTORY)
    np.testing.assert_allclose(reference.position(t), TRAJECTORY.evaluate(np.array([t]))[0, :3], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(
        reference.velocity(t), TRAJECTORY.evaluate(np.array([t]), 1)[0, :3], rtol=1e-12, atol=1e-12
    )


def test_a_course_is_what_was_told_last():
    courses = Courses(small_plan().trajectories)
    start = courses.start("cf1")
    assert courses.at("cf1", 1.0) is None
    courses.ways["cf1"] = Way((0.5, 0.4, 0.0), start, 1.0, 2.0)
    assert courses.at("cf1", 0.0) == (0.5, 0.4, 0.0)
    assert courses.at("cf1", 9.0) == pytest.approx(start)
    assert courses.left("cf1", 1.5) == pytest.approx(1.5)
    courses.search.start = 4.0
    courses.timelines["cf1"].restart(4.0)
    assert courses.at("cf1", 5.5) == courses.reference("cf1", 5.5) != start
    assert courses.left("cf1", 5.0) == pytest.approx(2.0)
    courses.ways["cf1"] = Way((1.0, 1.0, 1.0), start, 8.0, 2.0)
    assert courses.at("cf1", 8.0) == (1.0, 1.0, 1.0)
    assert courses.left("cf1", 20.0) == 0.0
    courses.forget("cf1")
    assert set(courses.references) == {"cf2"}


@given(st.floats(0.0, 1.0))
def test_a_way_is_the_certified_move(s):
    way = Way((1.0, 0.0, 0.5), (2.0, 0.0, 1.5), 3.0, 2.0)
    share = np.polynomial.Polynomial([0, 0, 0, 0, 35, -84, 70, -20])(s)
    assert way.position(3.0 + 2.0 * s) == pytest.approx((1.0 + share, 0.0, 0.5 + share))
