"""Waypoint files as published, least snap through them, times within limits."""

from math import perm

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.certificate.motion import largest_acceleration, largest_speed
from planner.interchange.errors import InterchangeError
from planner.interchange.minimum_snap import choose_times, minimum_snap
from planner.interchange.waypoints import parse_waypoints

# In the format of uav_trajectories' examples/spiral.csv (spaces, no header) and timed_waypoints_helix_yaw.csv (header).
SPIRAL = "0.0, 0.0, 1.0\n0.0, 0.0, 2.0\n0.5, 0.0, 2.0\n0.0, 0.5, 1.9\n-0.5, 0.0, 1.8\n0.0, -0.5, 1.7"
HELIX = "t,x,y,z,yaw\n0.0,1.0,0.0,0.0,0.0\n1.5,0.5,0.5,0.1,1.0\n2.25,0.0,1.0,0.2,2.5\n"


def random_points(count, seed):
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(size=(count, 4)) * 0.4, axis=0)
    return points, np.concatenate([[0.0], np.cumsum(rng.uniform(0.3, 3.0, count - 1))])


def test_the_published_formats():
    spiral = parse_waypoints(SPIRAL)
    assert spiral.times is None
    np.testing.assert_array_equal(spiral.points[3], [0.0, 0.5, 1.9])
    assert spiral.yaw is None
    helix = parse_waypoints(HELIX)
    np.testing.assert_array_equal(helix.times, [0.0, 1.5, 2.25])
    np.testing.assert_array_equal(helix.points[2], [0.0, 1.0, 0.2])
    np.testing.assert_array_equal(helix.yaw, [0.0, 1.0, 2.5])
    timed = parse_waypoints("0,1,2,3,\n1,2,3,4,\n\n")
    np.testing.assert_array_equal(timed.times, [0.0, 1.0])
    np.testing.assert_array_equal(timed.points, [[1.0, 2.0, 3.0], [2.0, 3.0, 4.0]])
    assert timed.yaw is None


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "0 waypoints"),
        ("0,0,1", "1 waypoints"),
        ("0,0,1\n" * 1001, "1001 waypoints"),
        ("x,y\n0,0\n1,1", "header 'x,y'"),
        ("0,0\n1,1", "a.csv:1: 2 columns"),
        ("0,0,1\n0,0,1,2", "a.csv:2: 4 columns"),
        ("0,0,1\n0,zero,1", "a.csv:2: could not convert"),
        ("0,0,1\n0,nan,1", "a.csv:2: got 0, nan, 1"),
        ("0,0,1\n0,inf,1", "a.csv:2"),
        ("0,0,1\n0,1e9,1", "a.csv:2"),
        ("0,0,1\n\n0,0,1", "a.csv:3: the same point"),
        ("1,0,0,1\n2,0,1,1", "a.csv:1: starts at t = 1 s"),
        ("0,0,0,1\n2,0,1,1\n2,1,1,1", "a.csv:3: t = 2 s after 2 s"),
    ],
)
def test_what_is_no_waypoint_file(text, expected):
    with pytest.raises(InterchangeError) as refused:
        parse_waypoints(text, "a.csv")
    assert expected in str(refused.value)
    assert str(refused.value).startswith("a.csv")
    assert "\n" not in str(refused.value)


@given(st.integers(2, 60), st.integers(0, 10_000))
@settings(max_examples=40, deadline=None)
def test_least_snap_is_smooth_to_the_sixth_derivative_and_rests_at_both_ends(count, seed):
    """Where only positions are given at inner knots, the minimum is C⁶: Euler and Lagrange's natural conditions."""
    points, times = random_points(count, seed)
    trajectory = minimum_snap(times, points)
    np.testing.assert_allclose(trajectory.evaluate(times), points, atol=1e-11)
    c, h = trajectory.coefficients, trajectory.durations
    for order in range(7):
        begin = perm(order, order) * c[:, :, order]
        end = sum(perm(k, order) * c[:, :, k] * h[:, None] ** (k - order) for k in range(order, 8))
        if count > 2:
            np.testing.assert_allclose(begin[1:], end[:-1], atol=1e-6 * np.abs(begin).max())
        if 1 <= order <= 3:
            np.testing.assert_allclose([begin[0], end[-1]], 0.0, atol=1e-8 * (1.0 + np.abs(begin).max()))


def test_least_snap_is_less_than_that_of_any_neighbour():
    points, times = random_points(6, 1)

    def snap(trajectory):
        t = np.linspace(0.0, times[-1], 20_001)[:-1]
        return float(np.square(trajectory.evaluate(t, 4)).sum(axis=1).mean())

    best = snap(minimum_snap(times, points))
    # Through one more point that the best one does not pass: the same class of curves, so never less snap.
    more = np.insert(times, 3, 0.5 * (times[2] + times[3]))
    on = minimum_snap(times, points).evaluate(more[3:4])
    assert snap(minimum_snap(more, np.insert(points, 3, on, axis=0))) == pytest.approx(best, rel=1e-6)
    assert snap(minimum_snap(more, np.insert(points, 3, on + 0.05, axis=0))) > best * 1.001


@given(st.integers(2, 40), st.integers(0, 10_000), st.floats(0.2, 2.0), st.floats(0.2, 4.0))
@settings(max_examples=30, deadline=None)
def test_chosen_times_keep_the_limits_and_use_them(count, seed, speed, acceleration):
    points, _ = random_points(count, seed)
    times = choose_times(points, speed, acceleration)
    assert times[0] == 0.0
    np.testing.assert_array_equal(times, np.round(times, 3))
    trajectory = minimum_snap(times, points)
    fast = largest_speed(trajectory).value / speed
    hard = largest_acceleration(trajectory).value / acceleration
    assert fast <= 1.0
    assert hard <= 1.0
    assert max(fast, hard**0.5) > 0.98


def test_times_of_points_that_are_a_micrometre_apart_are_not_whole_milliseconds_of_nothing():
    points = np.zeros((3, 4))
    points[:, 0] = [0.0, 1e-6, 1.0]
    times = choose_times(points, 1.0, 1.0)
    assert (np.diff(times) > 0.0).all()
    assert largest_acceleration(minimum_snap(times, points)).value <= 1.0
