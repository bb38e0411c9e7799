"""Every extremum the certificate states, on curves chosen to be hard: on the safe side of dense samples, and tight.

Tight means that the bound is within its stated resolution of a value the curve takes at the time that is reported.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from missions.airframes import GRAVITY, airframe
from missions.obstacles import BoxObstacle, CircleObstacle, CylinderObstacle, KeepInZone, KeepOutZone, PolygonObstacle
from missions.schema import Workspace
from planner.certificate import flatness, motion, obstacles, workspace
from planner.certificate.flatness import demands
from planner.certificate.separation import RESOLUTION, closest_approaches
from planner.trajectory.bezier import power_coefficients
from planner.trajectory.piecewise import PiecewisePolynomial

CF21 = airframe("cf21")
DRAG = max(CF21.drag) / CF21.mass
SECONDS = 6.0
SAMPLES = 801  # a piece
EPS = 1e-9

SHAPES = [
    CircleObstacle((0.3, -0.2), 0.4),
    CylinderObstacle((0.3, -0.2), 0.4, height=0.5),
    CylinderObstacle((0.3, -0.2), 0.2, height=1.0, base=0.4),
    BoxObstacle((-0.5, -0.2), (0.3, 0.5), rotation=0.7),
    BoxObstacle((-0.5, -0.2, 0.1), (0.3, 0.5, 0.4)),
    PolygonObstacle(((-0.5, -0.5), (0.6, -0.4), (0.0, 0.7))),
    PolygonObstacle(((-0.5, -0.5), (0.6, -0.4), (0.0, 0.7)), height=0.3),
    KeepOutZone(((-0.5, -0.5), (0.6, -0.4), (0.0, 0.7))),
]

TRIANGLE = ((-1.0, -1.0), (1.0, -1.0), (0.0, 1.5))


@st.composite
def nasty(draw, sizes=(1e-3, 1.0, 100.0)):
    """Pieces from a millisecond to seconds; points large, tiny, repeated; positions continuous."""
    durations = np.array(draw(st.lists(st.sampled_from([1e-3, 0.02, 1.0, 2.5]), min_size=1, max_size=4)))
    durations *= SECONDS / durations.sum()
    size = draw(st.sampled_from(sizes))
    elements = st.one_of(st.floats(-1, 1, width=16), st.sampled_from([0.0, 0.5, -0.5, 1.0]))
    points = size * draw(hnp.arrays(np.float64, (len(durations), 4, 8), elements=elements))
    points[1:, :, 0] = points[:-1, :, -1]
    return PiecewisePolynomial(durations, power_coefficients(points, durations))


@st.composite
def pairs(draw):
    """Two curves: strangers, twins, twins at a constant distance, or a curve and its mirror image that meets it."""
    one = draw(nasty())
    kind = draw(st.sampled_from(["strangers", "twins", "formation", "mirror"]))
    if kind == "strangers":
        return one, draw(nasty())
    other = one.coefficients.copy()
    if kind == "formation":
        other[:, 0, 0] += 0.3
    if kind == "mirror":
        other[:, 1] *= -1
    return one, PiecewisePolynomial(one.durations, other)


def size_of(*curves):
    """How large the numbers are that distances are differences of."""
    return max(float(np.abs(c.coefficients * c.durations[:, None, None] ** np.arange(8)).max()) for c in curves) + 1.0


def one_sided(curve, t, order=0):
    """(2, 4) values at a time, of the piece that ends there and of the one that begins."""
    knots = curve.knots()
    out = []
    for shift in (-EPS, EPS):
        m = int(np.clip(np.searchsorted(knots, t + shift, side="right") - 1, 0, curve.pieces - 1))
        single = PiecewisePolynomial(curve.durations[m : m + 1], curve.coefficients[m : m + 1])
        out.append(single.evaluate(np.clip(t - knots[m], 0.0, curve.durations[m]), order)[0])
    return np.array(out)


def dense(curve, order=0):
    """Samples of every piece, both its ends included."""
    parts = []
    for h, c in zip(curve.durations, curve.coefficients, strict=True):
        single = PiecewisePolynomial([h], c[None])
        parts.append(single.evaluate(np.linspace(0.0, single.duration, SAMPLES), order))
    return np.concatenate(parts)


@settings(max_examples=80, deadline=None)
@given(pairs())
def test_separation(curves):
    one, other = curves
    found = closest_approaches(curves, np.array([0.0, SECONDS]))
    bound, attained, time = found.bound[0, 0], found.attained[0, 0], found.time[0, 0]
    noise = 1e-6 * np.sqrt(size_of(*curves))
    t = np.union1d(np.linspace(0.0, SECONDS, 5 * SAMPLES), np.concatenate([one.knots(), other.knots()]))
    distance = np.linalg.norm((one.evaluate(t) - other.evaluate(t))[:, :3], axis=1)
    assert bound <= distance.min() + noise
    assert attained - RESOLUTION - EPS <= bound <= attained
    taken = np.linalg.norm((one_sided(one, time) - one_sided(other, time))[:, :3], axis=1)
    assert taken.min() == pytest.approx(attained, abs=noise + 1e-4)


@settings(max_examples=100, deadline=None)
@given(nasty(sizes=(1e-3, 1.0, 10.0)), st.sampled_from(SHAPES))
def test_obstacles_of_every_shape(curve, shape):
    found = obstacles.clearance(curve, shape)
    body = obstacles.body(shape)
    sampled = body.distance(dense(curve)[:, :3].T).value.min()
    assert found.bound[0] <= sampled + 1e-9 * size_of(curve)
    assert found.attained[0] - obstacles.RESOLUTION - EPS <= found.bound[0] <= found.attained[0]
    at = body.distance(one_sided(curve, found.time[0])[:, :3].T).value.min()
    assert at == pytest.approx(found.attained[0], abs=1e-5 * size_of(curve))


@settings(max_examples=60, deadline=None)
@given(nasty(sizes=(1e-3, 1.0, 100.0)))
def test_places_to_stay_in(curve):
    q = dense(curve)
    noise = 1e-9 * size_of(curve)
    side = workspace.inside(curve, Workspace((-1.0, -1.5, 0.1), (1.0, 2.0, 1.5)))
    sampled = min((q[:, :3] - (-1.0, -1.5, 0.1)).min(), ((1.0, 2.0, 1.5) - q[:, :3]).min())
    assert side.bound[0] <= sampled + noise
    assert side.attained[0] - workspace.RESOLUTION - EPS <= side.bound[0] <= side.attained[0]
    zone = obstacles.inside_zone(curve, KeepInZone(TRIANGLE))
    assert zone.attained[0] - obstacles.RESOLUTION - EPS <= zone.bound[0] <= zone.attained[0]
    corners = np.array(TRIANGLE)  # counter-clockwise: the inside is to the left of every edge
    edges = np.roll(corners, -1, axis=0) - corners
    left = _cross(edges[:, None], q[:, :2] - corners[:, None]) / np.linalg.norm(edges, axis=1)[:, None]
    assert zone.bound[0] <= left.min() + noise
    for axis in (2, 3):
        error = motion.largest_offset(curve, axis, 0.6)
        assert error.value >= np.abs(q[:, axis] - 0.6).max() - noise
        assert np.abs(one_sided(curve, error.time)[:, axis] - 0.6).max() >= error.value - motion.RESOLUTION - noise


def _cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


@settings(max_examples=60, deadline=None)
@given(nasty())
def test_speed_and_acceleration(curve):
    for order, found, norm in (
        (1, motion.largest_speed(curve), lambda x: np.linalg.norm(x[:, :3], axis=1)),
        (2, motion.largest_acceleration(curve), lambda x: np.abs(x[:, :3]).max(axis=1)),
    ):
        noise = 1e-9 * size_of(curve) / curve.durations.min() ** order
        assert found.value >= norm(dense(curve, order)).max() - noise
        taken = norm(one_sided(curve, found.time, order)).max()
        assert taken >= found.value - motion.RESOLUTION - 1e-6 * taken - noise


@settings(max_examples=100, deadline=None)
@given(nasty(sizes=(1e-3, 0.1, 0.3)))
def test_thrust_tilt_and_rates(curve):
    found = demands(curve, CF21)
    samples = asked_of(*(dense(curve, order) for order in (1, 2, 3)))
    size = 1.0 + size_of(curve) / curve.durations.min() ** 3
    noise = 1e-9 * size
    for name in samples:
        worst = getattr(found, name)
        taken = asked_of(*(one_sided(curve, worst.time, order) for order in (1, 2, 3)))[name]
        unit = CF21.mass if "thrust" in name else 1.0
        if not np.isfinite(worst.value) or (name == "tilt" and worst.value == np.pi):
            continue  # no attitude, or none below 90 degrees: the checks fail with these values
        if name == "least_thrust":
            assert worst.value <= samples[name].min() + noise
            assert taken.min() <= worst.value + flatness.RESOLUTION * unit + noise
            continue
        assert worst.value >= samples[name].max() * (1 - 1e-9) - noise
        if size < 1e6:  # [m/s³]; fourth powers of more are beyond float64: still a bound, but not a tight one
            assert taken.max() >= worst.value * (1 - 1e-6) - flatness.RESOLUTION * unit - noise


def asked_of(velocity, acceleration, jerk):
    """What the formulas in the module's docstring give at single instants."""
    f = acceleration[:, :3] + DRAG * velocity[:, :3] + (0.0, 0.0, GRAVITY)
    f1 = jerk[:, :3] + DRAG * acceleration[:, :3]
    s = np.linalg.norm(f, axis=1)
    return {
        "thrust": CF21.mass * s,
        "least_thrust": CF21.mass * s,
        "tilt": np.arccos(np.clip(f[:, 2] / s, -1.0, 1.0)),
        "rate": np.linalg.norm(np.cross(f, f1), axis=1) / s**2,
        "yaw_rate": np.abs(velocity[:, 3]),
    }
