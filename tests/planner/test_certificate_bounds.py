"""Bounds: never on the wrong side of dense samples, and within the stated resolution of them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from missions.schema import CircleObstacle, Workspace
from planner.certificate import motion, obstacles, workspace
from planner.certificate.bernstein import derivative, minimise, root, square_sum
from planner.certificate.separation import RESOLUTION, closest_approaches
from planner.trajectory.bezier import control_points, power_coefficients
from planner.trajectory.piecewise import PiecewisePolynomial

SAMPLES = 2001


@st.composite
def curves(draw, seconds=6.0, most=5):
    """Continuous random curves within ±2 m, all of the same duration up to float noise."""
    pieces = draw(st.integers(1, most))
    cuts = sorted(draw(st.sets(st.integers(1, 99), min_size=pieces - 1, max_size=pieces - 1)))
    knots = np.array([0, *cuts, 100]) * seconds / 100
    points = draw(hnp.arrays(np.float64, (pieces, 4, 8), elements=st.floats(-2, 2, width=16)))
    points[1:, :, 0] = points[:-1, :, -1]
    durations = np.diff(knots)
    return PiecewisePolynomial(durations, power_coefficients(points, durations))


def values_at(points, u):
    """De Casteljau, independent of the code under test."""
    level = np.repeat(points[..., None], len(u), axis=-1)
    while level.shape[-2] > 1:
        level = level[..., :-1, :] * (1 - u) + level[..., 1:, :] * u
    return level[..., 0, :]


@settings(max_examples=30, deadline=None)
@given(hnp.arrays(np.float64, (5, 8), elements=st.floats(-3, 3, width=32)), st.sampled_from([1e-2, 1e-5]))
def test_minimum_of_a_group(points, resolution):
    group = np.array([0, 1, 0, 2, 2])
    start = 2.0 * np.arange(5)
    found = minimise(points, start, start + 1, group, 4, resolution)
    u = np.linspace(0, 1, SAMPLES)
    sampled = values_at(points, u)
    for g in range(3):
        smallest = sampled[group == g].min()
        assert found.bound[g] <= smallest
        assert found.attained[g] - found.bound[g] <= resolution + 1e-12
        assert found.bound[g] >= smallest - resolution - 1e-4  # what sampling may miss
        piece = int(found.time[g] // 2)
        at = values_at(points[piece], np.array([found.time[g] - start[piece]]))[0]
        assert at == pytest.approx(found.attained[g], abs=1e-9)
    assert found.bound[3] == np.inf


def test_a_thousand_polynomials_need_few_rounds_and_find_touching_curves():
    """A double root at an irrational time: the hard case for a squared distance."""
    r = np.sqrt(0.5)
    coefficients = np.zeros((1, 8))
    coefficients[0, :3] = r * r, -2 * r, 1.0  # (t - √½)²
    points = control_points(coefficients, np.ones(1))
    found = minimise(points, np.zeros(1), np.ones(1), np.zeros(1, dtype=int), 1, 1e-4, root)
    assert found.bound[0] == 0.0
    assert found.attained[0] <= 1e-4
    assert found.time[0] == pytest.approx(r, abs=1e-4)


@given(hnp.arrays(np.float64, (3, 2, 6), elements=st.floats(-2, 2, width=32)))
def test_square_sum_and_derivative_agree_with_samples(points):
    u = np.linspace(0, 1, 17)
    expected = (values_at(points, u) ** 2).sum(axis=1)
    np.testing.assert_allclose(values_at(square_sum(points), u), expected, atol=1e-10)
    durations = np.array([0.5, 1.0, 3.0])
    step = 1e-6
    slope = (values_at(points, u[1:-1] + step) - values_at(points, u[1:-1] - step)) / (2 * step)
    mine = values_at(derivative(points, durations), u[1:-1]) * durations[:, None, None]
    np.testing.assert_allclose(mine, slope, atol=1e-5)


@settings(max_examples=40, deadline=None)
@given(st.lists(curves(), min_size=2, max_size=4), st.integers(1, 3))
def test_separation_never_exceeds_dense_samples_and_is_within_its_resolution(trajectories, count):
    periods = np.linspace(0, 6.0, count + 1)
    found = closest_approaches(trajectories, periods)
    t = np.unique(np.concatenate([np.linspace(0, 6.0, SAMPLES), found.time.ravel()]))
    q = np.stack([trajectory.evaluate(t)[:, :3] for trajectory in trajectories])
    for (i, j), bounds, attained, times in zip(found.pairs, found.bound, found.attained, found.time, strict=True):
        distance = np.linalg.norm(q[i] - q[j], axis=1)
        for p in range(count):
            inside = (t >= periods[p]) & (t <= periods[p + 1])
            assert bounds[p] <= distance[inside].min() + 1e-9
            assert attained[p] - bounds[p] <= RESOLUTION + 1e-9
            at = np.searchsorted(t, times[p])
            assert distance[at] == pytest.approx(attained[p], abs=1e-6)  # it truly comes this close, then


def test_drones_that_fly_together_are_at_distance_zero():
    curve = PiecewisePolynomial(np.ones(3), np.ones((3, 4, 8)))
    found = closest_approaches([curve, curve], np.array([0.0, 3.0]))
    assert found.bound[0, 0] == 0.0


def test_after_its_end_a_robot_holds_its_last_point():
    moving = np.zeros((1, 4, 8))
    moving[0, 0, 1] = 1.0  # x = t
    short = PiecewisePolynomial(np.array([1.0]), moving)
    waiting = np.zeros((1, 4, 8))
    waiting[0, 0, :2] = 3.0, -0.5  # x = 3 - t/2
    long = PiecewisePolynomial(np.array([4.0]), waiting)
    found = closest_approaches([short, long], np.array([0.0, 2.0, 4.0]))
    np.testing.assert_allclose(found.attained, [[1.0, 0.0]], atol=1e-6)


@settings(max_examples=40, deadline=None)
@given(curves(), st.floats(-2, 2), st.floats(-2, 2), st.floats(0.05, 1))
def test_extrema_of_one_robot(trajectory, x, y, radius):
    t = np.linspace(0, trajectory.duration, SAMPLES)
    q, v, a = (trajectory.evaluate(t, order)[:, :3] for order in range(3))

    gap = obstacles.clearance(trajectory, CircleObstacle((x, y), radius))
    sampled = np.linalg.norm(q[:, :2] - (x, y), axis=1).min() - radius
    assert gap.bound[0] <= sampled + 1e-9
    assert gap.attained[0] <= gap.bound[0] + obstacles.RESOLUTION + 1e-9

    side = workspace.inside(trajectory, Workspace((-1.0, -1.5), (1.0, 2.0)))
    assert side.bound[0] <= min((q[:, :2] + (1.0, 1.5)).min(), ((1.0, 2.0) - q[:, :2]).min()) + 1e-9
    assert side.attained[0] <= side.bound[0] + workspace.RESOLUTION + 1e-9

    speed, acceleration = motion.largest_speed(trajectory), motion.largest_acceleration(trajectory)
    # One-sided derivatives at joints: a joint may carry the extremum of either piece.
    assert speed.value >= np.linalg.norm(v, axis=1).max() - 1e-6
    assert acceleration.value >= np.abs(a).max() * (1 - 1e-9) - 1e-6
    ends = t[[0, -1]]
    assert motion.largest_at_ends(trajectory, 1).value == pytest.approx(
        np.linalg.norm(trajectory.evaluate(ends, 1)[:, :3], axis=1).max(), rel=1e-6, abs=1e-6
    )


def test_largest_values_of_a_known_curve():
    """x = t³ - t on [0, 2]: speed |3t² - 1| is 11 at the end, acceleration 6t is 12 there."""
    coefficients = np.zeros((2, 4, 8))
    coefficients[0, 0, [1, 3]] = -1.0, 1.0
    coefficients[1, 0, :4] = 0.0, 2.0, 3.0, 1.0  # the same about t = 1
    trajectory = PiecewisePolynomial(np.ones(2), coefficients)
    assert motion.largest_speed(trajectory).value == pytest.approx(11.0, abs=1e-4)
    assert motion.largest_speed(trajectory).time == pytest.approx(2.0)
    assert motion.largest_acceleration(trajectory).value == pytest.approx(12.0, abs=1e-4)
    assert motion.largest_jump(trajectory, 2).value == pytest.approx(0.0, abs=1e-12)
    assert motion.largest_jump(trajectory, 0).value == pytest.approx(0.0, abs=1e-12)


def test_astronomical_numbers_end_with_a_bound_instead_of_halving_for_ever():
    """Rounding of 1e25 hides any resolution: a decoded garbage piece once ate all memory here."""
    rng = np.random.default_rng(1)
    points = 1e25 * rng.standard_normal((40, 15))
    points[:, 0] = points[:, -1] = 0.0
    group = np.zeros(40, dtype=np.intp)
    found = minimise(points, np.zeros(40), np.ones(40), group, 1, 1e-4)
    assert found.bound[0] <= found.attained[0] <= 0.0
    touching = np.tile([0.0, 0.0, 1e-3], (3, 1))  # squares of ordinary size close as always
    assert minimise(touching, np.zeros(3), np.ones(3), group[:3], 1, 1e-4).bound[0] >= -1e-4
