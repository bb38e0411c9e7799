"""Signed distances of convex solids: against sampled surfaces, and the laws every such distance obeys."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.obstacles import BoxObstacle, CircleObstacle, CylinderObstacle, KeepOutZone, PolygonObstacle
from missions.shapes import Solid, counter_clockwise, half_planes, heights, outline, solid

QUAD = ((0.2, -0.1), (1.4, 0.1), (1.1, 0.9), (0.3, 0.7))
SHAPES = [
    CircleObstacle((0.5, 0.4), 0.6),
    CylinderObstacle((0.5, 0.4), 0.6, height=0.9, base=0.2),
    BoxObstacle((0.0, 0.2, 0.1), (1.0, 0.6, 0.8), rotation=0.5),
    BoxObstacle((0.0, 0.2), (1.0, 0.6)),
    PolygonObstacle(QUAD, height=0.7),
    PolygonObstacle(QUAD[::-1]),
]
IDS = [f"{shape.type}-{k}" for k, shape in enumerate(SHAPES)]


def surface(body, top=3.0, bottom=-2.0):
    """Points on a solid's surface, about a centimetre apart; endless walls are cut far away."""
    low, high = max(body.low, bottom), min(body.high, top)
    if len(body.vertices) == 1:
        angle = np.linspace(0.0, 2.0 * np.pi, 800)
        rim = body.vertices[0] + body.radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        inner = body.vertices[0]
    else:
        s = np.linspace(0.0, 1.0, 250)[:, None]
        edges = zip(body.vertices, np.roll(body.vertices, -1, axis=0), strict=True)
        rim = np.concatenate([a + s * (b - a) for a, b in edges])
        inner = body.vertices.mean(axis=0)
    z = np.linspace(low, high, 400 if high - low > 2 else 80)
    wall = np.concatenate([np.repeat(rim, len(z), axis=0), np.tile(z, len(rim))[:, None]], axis=1)
    caps = []
    for level in (body.low, body.high):
        if math.isfinite(level):
            flat = np.concatenate([inner + f * (rim - inner) for f in np.linspace(0.0, 1.0, 60)])
            caps.append(np.column_stack([flat, np.full(len(flat), level)]))
    return np.concatenate([wall, *caps])


def inside(body, x):
    if len(body.vertices) == 1:
        flat = math.dist(x[:2], body.vertices[0]) < body.radius
    else:
        normals, offsets = half_planes(body.vertices)
        flat = bool((normals @ x[:2] < offsets).all())
    return flat and body.low < x[2] < body.high


@pytest.mark.parametrize("shape", SHAPES, ids=IDS)
def test_the_distance_is_that_to_the_nearest_point_of_the_surface(shape):
    body = solid(shape)
    points = surface(body)
    for x in np.random.default_rng(0).uniform((-1.0, -1.0, 0.0), (2.0, 2.0, 1.2), (30, 3)):
        nearest = np.linalg.norm(points - x, axis=1).min()
        expected = -nearest if inside(body, x) else nearest
        assert body.distance(x[:, None]).value[0] == pytest.approx(expected, abs=0.012)


@pytest.mark.parametrize("shape", SHAPES, ids=IDS)
def test_gradients_have_length_one_and_are_those_of_the_distance(shape):
    body, rng, step = solid(shape), np.random.default_rng(1), 1e-6
    x, direction = rng.uniform((-1.0, -1.0, 0.0), (2.0, 2.0, 1.2), (400, 3)).T, rng.standard_normal((3, 400))
    value, gradient = body.distance(x)
    numeric = (body.distance(x + step * direction).value - body.distance(x - step * direction).value) / (2 * step)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=0), 1.0, atol=1e-12)
    np.testing.assert_allclose((gradient * direction).sum(axis=0), numeric, atol=1e-4)
    assert value.min() < 0.0 < value.max()


@pytest.mark.parametrize("shape", SHAPES, ids=IDS)
def test_the_distance_is_the_same_with_and_without_its_gradient(shape):
    x = np.random.default_rng(2).uniform(-1.0, 2.0, (3, 40, 25))
    np.testing.assert_allclose(solid(shape).value(x), solid(shape).distance(x).value, atol=1e-12)


@settings(max_examples=100, deadline=None)
@given(st.sampled_from(SHAPES), st.integers(0, 2**32 - 1))
def test_the_distance_is_convex_and_no_steeper_than_one(shape, seed):
    body = solid(shape)
    a, b = np.random.default_rng(seed).uniform(-2.0, 3.0, (2, 3, 20))
    at_a, at_b, between = (body.distance(x).value for x in (a, b, (a + b) / 2))
    assert (between <= (at_a + at_b) / 2 + 1e-12).all()
    assert (np.abs(at_a - at_b) <= np.linalg.norm(a - b, axis=0) + 1e-12).all()


def test_a_robot_at_the_very_centre_or_corner_is_told_a_way_out():
    for shape, x in ((SHAPES[0], (0.5, 0.4, 0.5)), (SHAPES[4], (*QUAD[0], 0.5)), (SHAPES[5], (*QUAD[1], 0.2))):
        value, gradient = solid(shape).distance(np.array(x)[:, None])
        assert np.isfinite(value).all()
        assert np.linalg.norm(gradient) == pytest.approx(1.0)


def test_what_stands_on_the_floor_cannot_be_passed_below():
    below_floor = np.array([[0.5], [0.4], [-0.01]])
    assert solid(CylinderObstacle((0.5, 0.4), 0.2, height=1.0)).distance(below_floor).value[0] < 0
    assert solid(CylinderObstacle((0.5, 0.4), 0.2, height=1.0, base=0.5)).distance(below_floor).value[0] > 0.4


def test_outlines_and_heights():
    box = BoxObstacle((1.0, 2.0, 0.1), (3.0, 2.5, 0.4), rotation=math.pi / 2)
    np.testing.assert_allclose(
        sorted(map(tuple, outline(box))), [(1.75, 1.25), (1.75, 3.25), (2.25, 1.25), (2.25, 3.25)]
    )
    assert heights(box) == (0.1, 0.4)
    assert heights(SHAPES[1]) == (0.2, 0.9)
    assert heights(SHAPES[4]) == (0.0, 0.7)
    for shape in (SHAPES[0], SHAPES[3], KeepOutZone(QUAD)):
        assert heights(shape) == (0.0, math.inf)
    circle = outline(SHAPES[0])
    np.testing.assert_allclose(np.linalg.norm(circle - (0.5, 0.4), axis=1), 0.6)
    for shape in (*SHAPES, KeepOutZone(QUAD)):
        x, y = outline(shape).T
        assert float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) > 0.0, "counter-clockwise"


def test_clockwise_polygons_are_turned_around():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    np.testing.assert_array_equal(counter_clockwise(square), square)
    np.testing.assert_array_equal(counter_clockwise(square[::-1]), square)


def test_solids_do_not_change():
    with pytest.raises(ValueError, match="read-only"):
        Solid(np.zeros((1, 2)), 1.0).vertices[0] = 1.0
