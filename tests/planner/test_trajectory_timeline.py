"""Where a robot is in a trajectory whose legs begin when they begin."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.trajectory.timeline import Timeline

TIMES = (0.0, 5.0, 9.0, 12.0)


def test_on_time_it_is_the_time_since_the_start():
    course = Timeline(TIMES, [100.0, 105.0, 109.0])
    for t in (0.0, 3.0, 5.0, 8.99, 11.0, 12.0):
        assert course.at(100.0 + t) == pytest.approx(t)
    assert course.at(90.0) == 0.0
    assert course.at(200.0) == 12.0


def test_a_late_leg_waits_at_the_end_of_the_one_before():
    course = Timeline(TIMES, [100.0, 105.2])
    assert course.at(105.1) == 5.0
    assert course.holds(105.1)
    assert not course.holds(104.9)
    assert course.at(106.2) == pytest.approx(6.0)
    assert course.at(120.0) == 9.0  # the third has not begun
    assert course.holds(120.0)
    course.begin(120.0)
    assert course.at(121.0) == pytest.approx(10.0)
    assert (course.begun, course.legs, course.latest) == (3, 3, 120.0)


def test_an_early_leg_jumps_ahead():
    course = Timeline(TIMES, [100.0, 104.9])
    assert course.at(104.899) == pytest.approx(4.899)
    assert course.at(104.9) == pytest.approx(5.0)


def test_before_anything_has_begun_nobody_knows():
    course = Timeline(TIMES)
    assert math.isnan(course.at(3.0))
    assert math.isnan(course.latest)
    assert course.holds(3.0)
    course.begin(1.0)
    course.restart(2.0)
    assert course.at(3.0) == 1.0


@given(
    st.lists(st.floats(-0.1, 0.1), min_size=3, max_size=3), st.lists(st.floats(99.0, 115.0), min_size=2, max_size=20)
)
def test_time_never_goes_back_and_is_never_farther_off_than_the_starts(late, moments):
    course = Timeline(TIMES, [100.0 + t + d for t, d in zip(TIMES, late, strict=False)])
    seen = [course.at(t) for t in sorted(moments)]
    assert seen == sorted(seen)
    for t in moments:
        if 100.2 < t < 111.8:
            assert abs(course.at(t) - (t - 100.0)) <= 0.1 + 1e-9
