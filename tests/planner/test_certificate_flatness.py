"""What bytes ask of a drone: bounds against samples of an independent rigid body, and the checks made of them."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from missions.airframes import GRAVITY, airframe
from missions.mappings import FrozenMapping
from missions.schema import FacingYaw, FixedYaw, Flight
from planner.certificate.certify import certify
from planner.certificate.flatness import RESOLUTION, demands
from planner.certificate.rational import largest_ratio
from planner.trajectory.bezier import power_coefficients
from planner.trajectory.piecewise import PiecewisePolynomial
from tests.planner.test_certificate_bounds import values_at
from tests.planner.test_certificate_certify import check_named, failed, good, mission, with_points

CF21 = airframe("cf21")
SAMPLES = 2001


@st.composite
def flights(draw, swing=2.0):
    """Smooth pieces with yaw; accelerations from gentle to more than any drone can do."""
    pieces = draw(st.integers(1, 3))
    durations = draw(hnp.arrays(np.float64, pieces, elements=st.floats(1.0, 4.0)))
    points = draw(hnp.arrays(np.float64, (pieces, 4, 8), elements=st.floats(-swing, swing, width=16)))
    return PiecewisePolynomial(durations, power_coefficients(points * draw(st.sampled_from([0.02, 0.2])), durations))


def rigid_body(trajectory, frame):
    """Thrust, tilt, body rates, yaw rate and motor thrusts of samples, by rotation matrices and finite differences."""
    out = []
    for start, h, c in zip(trajectory.knots(), trajectory.durations, trajectory.coefficients, strict=False):
        one = PiecewisePolynomial([h], c[None])
        step = 1e-4
        middle = np.linspace(0.0, h, SAMPLES)[1:-1]
        inner = middle[(middle > 3 * step) & (middle < h - 3 * step)]
        R = {k: _attitude(one, inner + k * step, frame) for k in (-2, -1, 0, 1, 2)}
        rate = {k: _vee(np.swapaxes(R[k], 1, 2) @ (R[k + 1] - R[k - 1]) / (2 * step)) for k in (-1, 0, 1)}
        spin = (rate[1] - rate[-1]) / (2 * step)
        J = np.array(frame.inertia)
        torque = J * spin + np.cross(rate[0], J * rate[0])
        f = _force(one, inner, frame)
        thrust = frame.mass * np.linalg.norm(f, axis=1)
        lever = frame.arm / np.sqrt(2)
        signs = np.array([(-1, -1, -1), (-1, 1, 1), (1, 1, -1), (1, -1, 1)])
        motors = thrust[:, None] / 4 + (torque / (lever, lever, frame.torque_per_thrust)) @ signs.T / 4
        tilt = np.arccos(f[:, 2] / np.linalg.norm(f, axis=1))
        turn = one.evaluate(inner, 1)[:, 3]
        out.append((start + inner, thrust, tilt, np.linalg.norm(rate[0][:, :2], axis=1), np.abs(turn), motors))
    return [np.concatenate(column) for column in zip(*out, strict=True)]


def _force(one, t, frame):
    drag = max(frame.drag) / frame.mass
    return one.evaluate(t, 2)[:, :3] + drag * one.evaluate(t, 1)[:, :3] + np.array([0.0, 0.0, GRAVITY])


def _attitude(one, t, frame):
    """Rotation matrices whose z axis is the thrust's direction and whose Z-Y-X yaw is the trajectory's."""
    z = _force(one, t, frame)
    z = z / np.linalg.norm(z, axis=1, keepdims=True)
    yaw = one.evaluate(t)[:, 3]
    side = np.stack([-np.sin(yaw), np.cos(yaw), 0 * yaw], axis=1)
    x = np.cross(side, z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=2)


def _vee(m):
    return np.stack([m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]], axis=1) / 2


@settings(max_examples=40, deadline=None)
@given(flights(), st.sampled_from(["cf21", "cf21_brushless"]))
def test_no_sample_asks_more_than_the_bounds_and_they_are_tight(trajectory, name):
    frame = airframe(name)
    found = demands(trajectory, frame)
    _, thrust, tilt, rate, turn, motors = rigid_body(trajectory, frame)
    slack = 1e-3  # finite differences
    assert found.thrust.value >= thrust.max() - 1e-9
    assert found.least_thrust.value <= thrust.min() + 1e-9
    assert found.tilt.value >= tilt.max() - 1e-9
    assert found.rate.value >= rate.max() * (1 - slack) - slack
    assert found.yaw_rate.value >= turn.max() - 1e-9
    assert found.motor.value >= motors.max() * (1 - slack) - 1e-5
    assert found.least_motor.value <= motors.min() + slack * abs(motors).max() + 1e-5
    if tilt.max() < 1.0:  # the samples leave out the ends of the pieces, where the largest value may be
        ends = _force_at_ends(trajectory, frame)
        force = np.concatenate([thrust / frame.mass, np.linalg.norm(ends, axis=1)])
        assert found.thrust.value <= frame.mass * (force.max() + RESOLUTION) + 1e-4
        assert found.least_thrust.value >= frame.mass * (force.min() - RESOLUTION) - 1e-4


def _force_at_ends(trajectory, frame):
    parts = []
    for h, c in zip(trajectory.durations, trajectory.coefficients, strict=True):
        parts.append(_force(PiecewisePolynomial([h], c[None]), np.array([0.0, h]), frame))
    return np.concatenate(parts)


def test_hover_asks_for_the_weight_and_nothing_else():
    found = demands(PiecewisePolynomial(np.ones(1), np.ones((1, 4, 8)) * (np.arange(8) == 0)), CF21)
    weight = CF21.mass * GRAVITY
    assert found.thrust.value == pytest.approx(weight)
    assert found.least_thrust.value == pytest.approx(weight)
    assert found.motor.value == pytest.approx(weight / 4)
    assert found.least_motor.value == pytest.approx(weight / 4)
    for none in (found.tilt, found.rate, found.yaw_rate):
        assert none.value == pytest.approx(0.0, abs=1e-6)


def test_a_circle_has_the_textbook_tilt_and_rate():
    """Radius 1 m at 2 rad/s: tilt atan(|a + D/m v| / g), its direction turning with the circle."""
    w, h = 2.0, 0.25
    t0 = h * np.arange(8)
    derivatives = np.array(
        [[w**k * np.cos(w * t0 + k * np.pi / 2), w**k * np.sin(w * t0 + k * np.pi / 2)] for k in range(8)]
    )
    coefficients = np.zeros((8, 4, 8))
    coefficients[:, :2] = np.moveaxis(derivatives, 0, 2).transpose(1, 0, 2) / np.cumprod([1, 1, 2, 3, 4, 5, 6, 7])
    found = demands(PiecewisePolynomial(np.full(8, h), coefficients), CF21)
    aside = np.hypot(w**2, max(CF21.drag) / CF21.mass * w)
    assert found.tilt.value == pytest.approx(np.arctan(aside / GRAVITY), abs=2 * RESOLUTION)
    assert found.rate.value == pytest.approx(w * np.sin(np.arctan(aside / GRAVITY)), abs=5 * RESOLUTION)
    assert found.thrust.value == pytest.approx(CF21.mass * np.hypot(GRAVITY, aside), abs=1e-4)


def test_free_fall_has_no_attitude():
    fall = np.zeros((1, 4, 8))
    fall[0, 2, 2] = -0.6 * GRAVITY
    found = demands(PiecewisePolynomial(np.ones(1), fall), CF21)
    assert found.tilt.value == np.pi
    assert found.rate.value == np.inf
    assert found.motor.value == np.inf


@settings(max_examples=60, deadline=None)
@given(
    hnp.arrays(np.float64, (3, 6), elements=st.floats(-4, 4, width=16)),
    hnp.arrays(np.float64, (3, 6), elements=st.floats(0.25, 4, width=16)),
)
def test_ratios_are_bounded_by_no_less_than_their_largest_sample(numerator, denominator):
    start = np.arange(3.0)
    bound, attained, time = largest_ratio(numerator, denominator, start, start + 1, 1e-4)
    u = np.linspace(0, 1, SAMPLES)
    sampled = values_at(numerator, u) / values_at(denominator, u)
    assert bound >= sampled.max() - 1e-12
    assert attained <= bound <= attained + 1e-4 + 1e-9
    piece = min(int(time), 2)
    at = [values_at(x[piece], np.array([time - piece]))[0] for x in (numerator, denominator)]
    assert at[0] / at[1] == pytest.approx(attained, abs=1e-9) or time == int(time)


def test_a_denominator_without_sign_has_no_bound():
    bound, _, _ = largest_ratio(np.ones((1, 3)), np.array([[1.0, -3.0, 1.0]]), np.zeros(1), np.ones(1), 1e-3)
    assert bound == np.inf


# ------------------------------------------------------------------------------------------------ checks


def jerked(by):
    """The good bytes with robot a thrown about inside one piece."""

    def change(p):
        p[2, 0, 3] += by
        p[2, 0, 4] -= by

    return with_points(change)


def test_more_than_the_motors_give_is_caught():
    certificate = certify(mission(), jerked(10.0))
    assert {"thrust", "motor thrust", "tilt"} <= failed(certificate)
    assert check_named(certificate, "thrust").where == "a"
    assert not certificate.passed


def test_falling_and_tumbling_are_caught():
    def drop(p):
        p[2, 2, 3:5] += 3.0

    assert {"least thrust", "least motor thrust"} <= failed(certify(mission(), with_points(drop)))


def test_turning_too_fast_is_caught():
    def whirl(p):
        p[2, 3, 4:] += 20.0
        p[3:, 3] += 20.0

    certificate = certify(mission(), with_points(whirl))
    assert "yaw rate" in failed(certificate)
    assert check_named(certificate, "yaw rate").limit == mission().trajectory.yaw_rate
    quick = dataclasses.replace(mission().trajectory, yaw_rate=20.0)
    assert check_named(certify(mission(trajectory=quick), good()), "yaw rate").limit == CF21.rate_limit[2]


def test_looking_elsewhere_is_caught():
    aside = dataclasses.replace(mission().trajectory, yaw=FixedYaw(angle=0.1))
    certificate = certify(mission(trajectory=aside), good())
    assert failed(certificate) == {"yaw"}
    assert check_named(certificate, "yaw").value == pytest.approx(0.1, abs=1e-6)
    turning = dataclasses.replace(mission().trajectory, yaw=FacingYaw(point=(1.0, 1.0)))
    assert certify(mission(trajectory=turning), good()).passed, "where it looks on its way is the planner's to judge"


def with_controller(controller, **parameters):
    named = {f"posCtlPid.{key}": value for key, value in parameters.items()}
    return mission(flight=Flight(altitude=0.6, controller=controller, parameters=FrozenMapping(named)))


def test_what_the_pid_controller_clips_is_a_warning():
    assert not any(check.name.startswith("PID") for check in certify(mission(), good()).checks)
    calm = certify(with_controller("pid"), good())
    assert calm.passed
    assert calm.warnings == ()
    tight = certify(with_controller("pid", xVelMax=0.2, rLimit=1.0), good())
    assert tight.passed
    assert [check.name for check in tight.warnings] == ["PID horizontal speed", "PID tilt"]
    assert tight.warnings[0].margin == pytest.approx(0.2 - 2.1875 * 2.0 / 10.0, abs=1e-3)
    assert tight.failures == ()


def test_a_failed_warning_never_hides_a_failure():
    check = certify(with_controller("pid", xVelMax=0.2), good()).warnings[0]
    assert not check.passed
    assert not check.fails
    assert dataclasses.replace(check, severity="failure").fails
