"""The fit: continuity, rest, limits and deviation of what comes out, whatever plan goes in."""

import dataclasses
import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.schema import TrajectorySettings
from planner.trajectory.blocks import solve_blocks
from planner.trajectory.bounded import LocalQuadratic
from planner.trajectory.encode import decode, encode
from planner.trajectory.encoded import Encoding
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.fit import AIM, deviation, fit
from planner.trajectory.knots import SHORTEST, move_knots, place_knots
from planner.trajectory.motion import plan_motion
from planner.trajectory.poly4d import MAX_PIECES
from planner.trajectory.regression import Bound, fit_motion
from planner.trajectory.search import fewest_pieces
from planner.trajectory.spline import SepticSpline, derivative_points, inner, local
from tests.planner.random_plans import DT, LIMIT, dense, mission_of, plan_of, sides_of_joints


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([20, 57, 300]), st.floats(0.1, 0.48))
def test_laws_of_a_fit(seed, steps, cap):
    plan = plan_of(seed, steps, cap=cap)
    mission = mission_of(plan)
    (trajectory,) = fit(plan, mission)

    assert trajectory.pieces <= MAX_PIECES
    assert trajectory.duration == pytest.approx(plan.t[-1], abs=1e-9)
    np.testing.assert_allclose(np.rint(trajectory.knots() * 1e3), trajectory.knots() * 1e3, atol=1e-6)
    ends = np.array([0.0, plan.t[-1]])
    np.testing.assert_allclose(trajectory.evaluate(ends)[:, :2], plan.q[[0, -1], 0], atol=1e-9)
    for order in (1, 2, 3):
        np.testing.assert_allclose(trajectory.evaluate(ends, order), 0.0, atol=1e-6)
    for order in range(4):
        before, after = sides_of_joints(trajectory, order)
        np.testing.assert_allclose(before, after, atol=1e-10 * 20.0**order)
    assert np.abs(trajectory.evaluate(dense(trajectory), 2)).max() <= LIMIT
    np.testing.assert_array_equal(trajectory.coefficients[:, 2, 1:], 0.0)
    np.testing.assert_array_equal(trajectory.evaluate(ends)[:, 2], 0.8)

    t = np.linspace(0, plan.t[-1], 7 * steps)
    error = np.linalg.norm(trajectory.evaluate(t)[:, :2] - plan_motion(plan, 0, t), axis=1).max()
    assert error <= mission.trajectory.tolerance
    assert error == pytest.approx(deviation(plan, 0, trajectory)[0], rel=0.05)


@settings(max_examples=12, deadline=None)
@given(
    st.integers(0, 10_000), st.sampled_from(["poly4d", "compressed", "auto"]), st.floats(0.1, 0.5), st.floats(0.25, 0.6)
)
def test_what_is_encoded_keeps_the_tolerance_or_is_refused(seed, encoding, cap, band):
    """Random smooth 3-D curves: bytes within the tolerance that join and keep the limit; or one line why not."""
    plan = plan_of(seed, steps=120, axes=3, cap=cap, band=band)
    mission = mission_of(plan, trajectory=TrajectorySettings(encoding=encoding))
    try:
        (trajectory,) = fit(plan, mission)
    except TrajectoryError:
        hard = cap > 0.9 * LIMIT or encoding == "compressed"
        assert hard  # a plan well inside the limit has polynomials
        return
    encoded = encode(trajectory, mission.trajectory)
    flown = decode(encoded)
    assert deviation(plan, 0, flown)[0] <= mission.trajectory.tolerance
    assert np.abs(flown.evaluate(dense(flown), 2)).max() <= LIMIT + 1e-3
    millimetres = encoded.legs[0].encoding is Encoding.COMPRESSED
    before, after = sides_of_joints(flown, 0)
    np.testing.assert_allclose(before, after, atol=1e-5)
    before, after = sides_of_joints(flown, 1)
    np.testing.assert_allclose(before, after, atol=7e-3 if millimetres else 1e-4)
    assert encode(flown, mission.trajectory).legs[0].data == encoded.legs[0].data or millimetres


@pytest.mark.parametrize("seed", range(4))
def test_as_few_pieces_as_the_aim_needs(seed):
    """Error-driven knots need far fewer than even ones, and one piece less is not enough."""
    plan = plan_of(seed, band=0.3)
    mission = mission_of(plan)
    (trajectory,) = fit(plan, mission)
    aim = AIM * mission.trajectory.tolerance
    assert deviation(plan, 0, trajectory)[0] <= 1.1 * aim
    even = fit_motion(
        functools.partial(plan_motion, plan, 0), np.linspace(0, 30, trajectory.pieces + 1), Bound(2, LIMIT)
    )
    assert even.error > 2 * aim
    wider = mission_of(plan, trajectory=TrajectorySettings(tolerance=0.1))
    assert fit(plan, wider)[0].pieces < trajectory.pieces


def test_a_jump_of_the_control_at_the_start_is_caught_up():
    """Plans may start with full acceleration; the polynomial starts at rest and has to catch up within the limit."""
    plan = plan_of(3, cap=0.3, ramp=0)
    assert np.abs(plan.u[0]).max() > 0.1
    (trajectory,) = fit(plan, mission_of(plan))
    assert deviation(plan, 0, trajectory)[0] < 0.01
    assert np.abs(trajectory.evaluate(dense(trajectory), 2)).max() <= LIMIT


def test_a_plan_beyond_the_limit_is_refused_with_robot_and_figures():
    plan = plan_of(5, steps=100, robots=2, cap=1.5)
    with pytest.raises(TrajectoryError, match=r"robot r0: .* deviate \d+\.\d mm .* allowed are 10 mm"):
        fit(plan, mission_of(plan, trajectory=TrajectorySettings(encoding="poly4d")))


def test_a_robot_that_stays_where_it_is():
    plan = plan_of(1, steps=100)
    still = dataclasses.replace(plan, q=np.full_like(plan.q, 1.5), v=np.zeros_like(plan.v), u=np.zeros_like(plan.u))
    (trajectory,) = fit(still, mission_of(still))
    np.testing.assert_allclose(trajectory.evaluate(np.linspace(0, 10, 99))[:, :2], 1.5, atol=1e-9)


def test_three_axes_are_followed():
    plan = plan_of(2, axes=3, robots=2)
    for robot, trajectory in enumerate(fit(plan, mission_of(plan))):
        assert deviation(plan, robot, trajectory)[0] < 5e-3
        assert np.ptp(trajectory.evaluate(plan.t)[:, 2]) > 0.1


@pytest.mark.parametrize("encoding", ["auto", "compressed"])
def test_more_pieces_than_poly4d_holds_go_compressed(encoding):
    plan = plan_of(7, steps=1200, cap=0.4, band=0.5)
    mission = mission_of(plan, trajectory=TrajectorySettings(encoding=encoding))
    (trajectory,) = fit(plan, mission)
    encoded = encode(trajectory, mission.trajectory)
    assert trajectory.pieces > MAX_PIECES
    assert encoded.legs[0].encoding is Encoding.COMPRESSED
    assert deviation(plan, 0, decode(encoded))[0] <= mission.trajectory.tolerance


def test_pieces_are_short_where_the_acceleration_bends():
    plan = plan_of(0, steps=200)
    u = np.zeros_like(plan.u)
    u[100:105], u[105:110] = 0.4, -0.4
    v = np.concatenate([np.zeros_like(plan.v[:1]), np.cumsum(u, axis=0) * DT])
    kinked = dataclasses.replace(plan, u=u, v=v)
    knots = place_knots(kinked, 0, 20)
    shortest = np.argmin(np.diff(knots))
    assert 9.5 < knots[shortest] < 11.5
    assert np.diff(knots).min() >= SHORTEST - 1e-3


@given(st.integers(1, 40), st.integers(1, 40), st.sampled_from([0.06, 0.7]), st.integers(0, 1000))
def test_knots_move_to_where_the_error_is(pieces, wanted, shortest, seed):
    rng = np.random.default_rng(seed)
    knots = np.concatenate([[0.0], np.cumsum(rng.uniform(shortest, 3.0, pieces))])
    errors = rng.uniform(0.0, 1.0, pieces)
    moved = move_knots(knots, errors, wanted, 6.0, shortest)
    assert moved[0] == 0.0
    assert moved[-1] == knots[-1]
    assert 1 <= len(moved) - 1 <= wanted
    if len(moved) > 2:
        assert np.diff(moved).min() >= shortest - 1.1e-3
    still = move_knots(np.linspace(0, 40, pieces + 1), np.ones(pieces), pieces, 6.0, 0.06)
    np.testing.assert_allclose(still, np.linspace(0, 40, pieces + 1), atol=1e-3)


def test_fewest_pieces_of_an_error_that_is_known():
    """Errors h⁴ on the left half, a thousandth of that on the right: pieces crowd on the left, one less misses."""

    @dataclasses.dataclass(frozen=True)
    class Known:
        knots: np.ndarray
        errors: np.ndarray
        excess: float = 0.0

        pieces = property(lambda self: len(self.errors))
        error = property(lambda self: float(self.errors.max()))
        spline = property(lambda self: self)

    def attempt(knots, aim):
        h = np.diff(knots)
        return Known(knots, h**4 * np.where(knots[:-1] < 5.0, 1.0, 1e-3))

    found = fewest_pieces(attempt, np.linspace(0.0, 10.0, 8), 1e-2, 100)
    assert found.error <= 1e-2
    assert found.pieces <= 26  # 16 pieces of 0.32 s on the left, 3 on the right; even ones: 32
    beyond = fewest_pieces(
        lambda knots, aim: dataclasses.replace(attempt(knots, aim), excess=float(len(knots) < 40)),
        np.linspace(0.0, 10.0, 8),
        1e-2,
        100,
    )
    assert beyond.pieces >= 39  # the bound comes first


def test_spline_maps_agree_with_its_polynomials():
    """Two ways to the same derivative: design matrices and power coefficients."""
    rng = np.random.default_rng(0)
    knots = np.cumsum([0.0, 0.3, 1.0, 0.15, 2.0])
    spline = SepticSpline(knots)
    unknowns = rng.normal(size=(2, 5, 4))
    coefficients = spline.coefficients(unknowns)  # (M, axes, 8)
    h = spline.durations[:, None]
    for order in range(4):
        powers = np.polynomial.polynomial.polyder(np.moveaxis(coefficients, -1, 0), order)  # (8-order, M, axes)
        states = (unknowns / spline.scales[:, None] ** np.arange(4))[..., order].T  # (knots, axes)
        np.testing.assert_allclose(powers[0], states[:-1], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(sum(c * h**k for k, c in enumerate(powers)), states[1:], rtol=1e-7, atol=1e-6)
        points = (derivative_points(order, 2) @ spline.points @ local(unknowns)[..., None])[..., 0] / h**order
        points = points.reshape(2, 4, 4, 8 - order)  # axis, piece, quarter, control point
        for quarter in range(4):
            at = quarter / 4 * h
            expected = sum(c * at**k for k, c in enumerate(powers))
            np.testing.assert_allclose(points[:, :, quarter, 0].T, expected, rtol=1e-7, atol=1e-6)


@settings(max_examples=30)
@given(st.integers(1, 70), st.integers(1, 3), st.integers(0, 1000))
def test_blocks_solve_what_a_dense_matrix_solves(count, systems, seed):
    rng = np.random.default_rng(seed)
    size = 4
    whole = np.zeros((systems, count, size, count, size))
    root = rng.normal(size=(systems, count, size, 2 * size))
    k = np.arange(count - 1)
    whole[:, np.arange(count), :, np.arange(count)] = np.moveaxis(root @ root.swapaxes(-1, -2), 1, 0)
    upper = 0.3 * rng.normal(size=(systems, count - 1, size, size))
    whole[:, k, :, k + 1] = np.moveaxis(upper, 1, 0)
    whole[:, k + 1, :, k] = np.moveaxis(upper, 1, 0).swapaxes(-1, -2)
    whole[:, np.arange(count), :, np.arange(count)] += 3.0 * np.eye(size)
    diagonal = np.moveaxis(whole[:, np.arange(count), :, np.arange(count)], 0, 1)
    right = rng.normal(size=(systems, count, size, 2))
    x = solve_blocks(diagonal, upper, right)
    product = np.einsum("skilj,sljc->skic", whole, x)
    np.testing.assert_allclose(product, right, atol=1e-7)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 30))
def test_bounded_fits_are_optimal(seed, pieces):
    """Karush-Kuhn-Tucker: feasible, and the gradient is a combination of active rows with the right signs."""
    rng = np.random.default_rng(seed)
    axes, cap = 2, 0.3
    root = rng.normal(size=(pieces, 8, 10))
    H = root @ root.swapaxes(1, 2) / 8
    fixed = np.zeros((axes, pieces + 1, 4))
    fixed[:, [0, -1]] = rng.uniform(-0.02, 0.02, (axes, 2, 4))  # nothing else is feasible
    quadratic = LocalQuadratic(H, rng.normal(size=(axes, pieces, 8)), fixed)
    rows = rng.normal(size=(pieces, 12, 8)) / 3
    x = quadratic.bounded(rows, cap, 1e-7)
    np.testing.assert_array_equal(x[:, [0, -1]], fixed[:, [0, -1]])
    y = np.einsum("mrj,amj->amr", rows, local(x))
    assert np.abs(y).max() <= cap + 1e-6
    for axis in range(axes):
        active = np.argwhere(np.abs(y[axis]) >= cap - 1e-4)
        if not len(active):
            np.testing.assert_allclose(quadratic.residual(x)[axis], 0.0, atol=1e-6)
            continue
        pushes = []
        for piece, row in active:
            push = np.zeros((1, pieces, 8))
            push[0, piece] = rows[piece, row] * np.sign(y[axis, piece, row])
            pushes.append(inner(push).ravel())
        target = quadratic.residual(x)[axis].ravel()
        multipliers, *_ = np.linalg.lstsq(np.array(pushes).T, target, rcond=None)
        np.testing.assert_allclose(np.array(pushes).T @ multipliers, target, atol=1e-3)
        assert (multipliers >= -1e-3).all()


def test_plan_motion_is_the_double_integrator():
    plan = plan_of(4, robots=2)
    s = 0.037
    t = plan.t[:-1] + s
    expected = plan.q[:-1] + plan.v[:-1] * s + plan.u * s**2 / 2
    for robot in range(2):
        np.testing.assert_allclose(plan_motion(plan, robot, t), expected[:, robot], atol=1e-9)
        np.testing.assert_allclose(plan_motion(plan, robot, t, 1), (plan.v[:-1] + plan.u * s)[:, robot], atol=1e-9)
        np.testing.assert_allclose(plan_motion(plan, robot, t, 2), plan.u[:, robot], atol=1e-8)
