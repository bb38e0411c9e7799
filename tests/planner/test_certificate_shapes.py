"""Bounds on the distance to any convex solid, and what the certificate says about shapes, zones, ends and heights."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.obstacles import BoxObstacle, CircleObstacle, CylinderObstacle, KeepInZone, KeepOutZone, PolygonObstacle
from missions.schema import (
    Flight,
    Horizon,
    Limits,
    Mission,
    MissionSource,
    NoConnectivity,
    Robot,
    RobotLimits,
    UniformMap,
    Workspace,
)
from missions.shapes import SignedDistance, Solid, outline, solid
from planner.certificate import branching, obstacles
from planner.certificate.certify import certify
from planner.certificate.convex import closest
from planner.trajectory.bezier import control_points, power_coefficients
from planner.trajectory.encode import encode
from planner.trajectory.piecewise import PiecewisePolynomial

SECONDS = 10.0
HALL = Workspace((10.0, -20.0), (13.0, -18.0))  # far off the origin
HOP = 2.0  # [m]
ORIGIN = np.array([10.5, -19.5])


def profile():
    """Degree-7 points from 0 to 1, at rest at both ends up to jerk."""
    return np.array([0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0])


def along(begin, end, bump=0.0):
    """A straight way from begin to end (3,), at rest at both ends; in the middle higher by up to ``bump``."""
    points = np.zeros((1, 4, 8))
    points[0, :3] = np.array(begin)[:, None] + np.subtract(end, begin)[:, None] * profile()
    points[0, 2, 3:5] += bump
    durations = np.array([SECONDS])
    return encode(PiecewisePolynomial(durations, power_coefficients(points, durations)))


def mission(**changes):
    base = Mission(
        schema_version=1,
        name="hall",
        workspace=HALL,
        horizon=Horizon(SECONDS, 0.1),
        information=UniformMap(),
        robots=(Robot("a", tuple(ORIGIN)), Robot("b", (10.5, -18.5))),
        limits=Limits(acceleration=1.0, speed=1.5, separation=0.3),
        connectivity=NoConnectivity(),
        flight=Flight(altitude=0.6),
        source=MissionSource("m.yaml", "a mission", {}),
    )
    return dataclasses.replace(base, **changes)


def straight(a_end=(12.5, -19.5), b_end=(12.5, -18.5), z=(0.6, 0.6)):
    return {
        "a": along((10.5, -19.5, z[0]), (*a_end, z[0])),
        "b": along((10.5, -18.5, z[1]), (*b_end, z[1])),
    }


def failed(certificate):
    return {check.name for check in certificate.checks if not check.passed}


def named(certificate, name):
    return next(check for check in certificate.checks if check.name == name)


# ------------------------------------------------------------------------------------------------ bounds

SOLIDS = [
    Solid(np.array([[0.2, 0.1]]), 0.4),
    Solid(np.array([[0.2, 0.1]]), 0.4, high=0.3),
    Solid(np.array([[0.2, 0.1]]), 0.4, low=-0.2, high=0.3),
    Solid(outline(BoxObstacle((-0.5, -0.2), (0.3, 0.5), rotation=0.7)), low=-0.1, high=0.4),
    solid(PolygonObstacle(((-0.5, -0.5), (0.6, -0.4), (0.0, 0.7)))),
    Solid(np.array([[-0.5, -0.5], [0.6, -0.4], [0.0, 0.7]]), 0.1, high=0.2),
]


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(SOLIDS), st.integers(0, 2**32 - 1), st.sampled_from([0.3, 1.0, 3.0]))
def test_no_sample_is_closer_than_the_bound_and_the_bound_is_tight(body, seed, size):
    rng = np.random.default_rng(seed)
    durations = rng.uniform(0.5, 2.0, 3)
    points = rng.normal(0.0, size, (3, 3, 8)) + rng.normal(0.0, 1.0, 3)[:, None]
    ends = np.cumsum(durations)
    found = closest(points, ends - durations, ends, body, 1e-4)
    coefficients = np.zeros((3, 4, 8))
    coefficients[:, :3] = power_coefficients(points, durations)
    curve = PiecewisePolynomial(durations, coefficients)
    t = np.sort(np.concatenate([np.linspace(0.0, ends[-1], 4001), np.nextafter(ends, 0.0)]))
    sampled = body.distance(curve.evaluate(t)[:, :3].T).value
    assert found.bound[0] <= sampled.min() + 1e-9
    assert found.attained[0] - 1e-4 <= found.bound[0] <= found.attained[0]
    at_time = body.distance(curve.evaluate(found.time)[:, :3].T).value
    assert at_time[0] == pytest.approx(found.attained[0], abs=1e-6) or np.isclose(found.time, ends, atol=1e-9).any()


class Liar(Solid):
    """A solid whose own distance is of no use: values too large, directions at random or none at all."""

    def distance(self, x):
        rng = np.random.default_rng(0)
        gradient = rng.standard_normal(x.shape)
        gradient[:, rng.random(x.shape[1:]) < 0.1] = 0.0
        return SignedDistance(super().distance(x).value + 0.1, gradient)


@pytest.mark.parametrize("seed", range(5))
def test_the_bound_holds_wherever_its_half_spaces_come_from(seed, monkeypatch):
    """The proof needs the vertices only: a mistake in the distance all others use could not make it pass."""
    monkeypatch.setattr(branching, "ROUNDS", 8)  # bad directions close no gap, so there is no end to wait for
    rng = np.random.default_rng(seed)
    points = rng.normal(0.0, 0.5, (1, 3, 8)) + np.array([1.5, 0.0, 0.0])[:, None]
    body = SOLIDS[3]
    truth = closest(points, np.zeros(1), np.ones(1), body, 1e-4)
    assert truth.attained[0] - truth.bound[0] <= 1e-2
    liar = Liar(body.vertices, body.radius, body.low, body.high)
    assert closest(points, np.zeros(1), np.ones(1), liar, 0.5).bound[0] <= truth.attained[0]


@pytest.mark.parametrize("seed", range(10))
def test_circles_are_bounded_alike_by_squares_and_by_half_spaces(seed):
    rng = np.random.default_rng(seed)
    coefficients = rng.normal(0.0, 0.3, (4, 4, 8)) * 0.5 ** np.arange(8)
    trajectory = PiecewisePolynomial(np.full(4, 1.3), coefficients)
    circle = CircleObstacle((0.4, -0.2), 0.3)
    by_squares = obstacles.clearance(trajectory, circle)
    points, knots = control_points(coefficients[:, :3], trajectory.durations), trajectory.knots()
    by_planes = closest(points, knots[:-1], knots[1:], solid(circle), 1e-4)
    assert by_planes.bound[0] == pytest.approx(by_squares.bound[0], abs=2e-4)


@pytest.mark.parametrize("seed", range(6))
def test_the_nearest_of_many_is_the_nearest_of_all(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    coefficients = rng.normal(0.0, 0.3, (4, 4, 8)) * 0.5 ** np.arange(8)
    trajectory = PiecewisePolynomial(np.full(4, 1.3), coefficients)
    shapes = (lambda at: CircleObstacle(at, 0.2), lambda at: CylinderObstacle(at, 0.2, height=1.0))
    places = rng.uniform(-6.0, 6.0, (40, 2))
    things = [(str(k), shapes[k % 2](tuple(place))) for k, place in enumerate(places)]
    things.append(("box", BoxObstacle((5.0, -6.0), (6.0, 6.0), rotation=0.4)))
    one_by_one = {label: obstacles.clearance(trajectory, thing).bound[0] for label, thing in things}
    proofs = []
    clearance = obstacles.clearance
    monkeypatch.setattr(obstacles, "clearance", lambda *args: proofs.append(args) or clearance(*args))
    label, found = obstacles.nearest(trajectory, things)
    assert found.bound[0] == min(one_by_one.values()) == one_by_one[label]
    assert len(proofs) < len(things)
    assert obstacles.nearest(trajectory, []) is None


# ------------------------------------------------------------------------------------------------ checks

TRIANGLE = ((11.3, -19.4), (11.7, -19.4), (11.5, -19.0))


@pytest.mark.parametrize(
    ("shape", "gap"),
    [
        (CircleObstacle((11.5, -19.0), 0.4), 0.1),
        (CylinderObstacle((11.5, -19.0), 0.4, height=2.0), 0.1),
        (CylinderObstacle((11.5, -19.5), 0.4, height=0.5), 0.1),  # below
        (CylinderObstacle((11.5, -19.5), 0.4, height=2.0, base=0.8), 0.2),  # above
        (BoxObstacle((11.0, -19.3), (12.0, -19.1)), 0.2),
        (PolygonObstacle(TRIANGLE), 0.1),
        (PolygonObstacle(TRIANGLE[::-1], height=0.2), np.hypot(0.1, 0.4)),
    ],
    ids=lambda value: getattr(value, "type", ""),
)
def test_clearances_are_those_of_the_geometry(shape, gap):
    certificate = certify(mission(obstacles=(shape,)), straight())
    assert certificate.passed
    assert named(certificate, "obstacles").value == pytest.approx(gap, abs=2e-4)
    assert named(certificate, "obstacles").where == "a, obstacles[0]"
    assert certificate.indicators.smallest_clearance == pytest.approx(gap, abs=2e-4)


@pytest.mark.parametrize(
    "shape",
    [
        CylinderObstacle((11.5, -19.5), 0.2, height=0.7),
        BoxObstacle((11.4, -20.0), (11.5, -19.0), rotation=0.2),
        PolygonObstacle(((11.3, -19.6), (11.7, -19.6), (11.5, -19.0))),
        KeepOutZone(((11.3, -19.6), (11.7, -19.6), (11.5, -19.0))),
        KeepOutZone(((11.3, -19.6), (11.7, -19.6), (11.5, -19.0)), robots=("a",)),
    ],
    ids=lambda shape: shape.type,
)
def test_flying_through_is_caught(shape):
    zone = isinstance(shape, KeepOutZone)
    changed = mission(zones=(shape,)) if zone else mission(obstacles=(shape,))
    certificate = certify(changed, straight())
    name = "keep-out zones" if zone else "obstacles"
    assert failed(certificate) == {name}
    assert named(certificate, name).value < -0.05
    assert named(certificate, name).where == f"a, {'zones' if zone else 'obstacles'}[0]"


def test_zones_bind_whom_they_name():
    through = ((11.3, -19.6), (11.7, -19.6), (11.5, -19.0))
    assert certify(mission(zones=(KeepOutZone(through, robots=("b",)),)), straight()).passed
    half = ((10.0, -20.0), (13.0, -20.0), (13.0, -19.0), (10.0, -19.0))
    assert certify(mission(zones=(KeepInZone(half, robots=("a",)),)), straight()).passed
    certificate = certify(mission(zones=(KeepInZone(half),)), straight())
    assert failed(certificate) == {"keep-in zones"}
    assert named(certificate, "keep-in zones").value == pytest.approx(-0.5, abs=2e-4)
    assert named(certificate, "keep-in zones").where == "b, zones[0]"


def test_ends_that_are_given_are_checked():
    home = (dataclasses.replace(mission().robots[0], end=(12.5, -19.5)), mission().robots[1])
    assert certify(mission(robots=home), straight()).passed
    away = (dataclasses.replace(mission().robots[0], end="start"), mission().robots[1])
    certificate = certify(mission(robots=away), straight())
    assert failed(certificate) == {"end point"}
    assert named(certificate, "end point").value == pytest.approx(HOP, abs=1e-4)
    assert named(certificate, "end point").time == SECONDS


def test_limits_of_one_robot_bind_that_robot():
    speed = named(certify(mission(), straight()), "speed").value
    slow = dataclasses.replace(mission().robots[1], limits=RobotLimits(speed=0.9 * speed, acceleration=0.01))
    certificate = certify(mission(robots=(mission().robots[0], slow)), straight())
    assert failed(certificate) == {"speed", "acceleration"}
    assert named(certificate, "speed").where == "b"
    assert named(certificate, "speed").limit == pytest.approx(0.9 * speed)


def layered(vertical, height):
    """Both fly to the same point seen from above, then land side by side: b crosses a's way, at another height."""
    return mission(
        limits=Limits(1.0, 1.5, 0.3, vertical_separation=vertical),
        robots=(Robot("a", (10.5, -19.5)), Robot("b", (12.5, -19.5), altitude=height)),
    )


def crossing(height):
    return {
        "a": along((10.5, -19.5, 0.6), (12.5, -19.5, 0.6)),
        "b": along((12.5, -19.5, height), (10.5, -19.5, height)),
    }


@pytest.mark.parametrize(
    ("vertical", "height", "passes"), [(0.6, 1.3, True), (0.6, 1.1, False), (None, 1.0, True), (None, 0.85, False)]
)
def test_downwash_makes_the_separation_an_ellipsoid(vertical, height, passes):
    certificate = certify(layered(vertical, height), crossing(height))
    assert certificate.passed is passes
    scale = 0.3 / (vertical or 0.3)
    assert named(certificate, "separation").value == pytest.approx((height - 0.6) * scale, abs=2e-4)
    assert certificate.indicators.smallest_separation == pytest.approx(height - 0.6, abs=2e-4), "metres, not scaled"
    assert failed(certificate) <= {"separation"}


def test_everybody_flies_at_a_height_of_its_own():
    assert failed(certify(layered(None, 1.0), crossing(1.1))) == {"altitude"}
    assert named(certify(layered(None, 1.0), crossing(1.1)), "altitude").where == "b"


def test_a_start_in_motion_is_certified_for_no_flight_by_one_check():
    moving = straight()
    durations = np.array([SECONDS])
    points = np.zeros((1, 4, 8))
    points[0, :3] = np.array([10.5, -19.5, 0.6])[:, None] + np.array([HOP, 0.0, 0.0])[:, None] * profile()
    points[0, 0, 1:3] += 0.1 * SECONDS / 7 * np.array([1.0, 2.0])  # 0.1 m/s at the start, no acceleration
    points[0, 0, 3] += 0.1 * SECONDS / 7 * 3
    moving["a"] = encode(PiecewisePolynomial(durations, power_coefficients(points, durations)))
    robots = (dataclasses.replace(mission().robots[0], velocity=(0.1, 0.0)), mission().robots[1])
    certificate = certify(mission(robots=robots), moving)
    assert failed(certificate) == {"velocity at rest"}
    assert named(certificate, "velocity at rest").value == pytest.approx(0.1, abs=1e-4)
