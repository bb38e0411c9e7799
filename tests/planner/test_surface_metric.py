"""Looks at a surface: against rays one by one, against definitions, as grids become finer, and their gradients."""

from __future__ import annotations

import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.footprint import CameraFootprint
from missions.placing import spread
from missions.trajectory import FacingYaw, FixedYaw
from planner.ergodic.basis import CosineBasis
from planner.errors import PlannerError
from planner.indicators import ergodic_metric
from planner.surface.camera import Camera
from planner.surface.metric import Views
from planner.surface.mission import surface_of
from planner.surface.rays import Rays
from planner.surface.seen import seen_surface
from planner.surface.views import Grid, looks
from tests.planner.objects_bench import BOX, CHAIR, STATUE, as_cloud, read, text

STEP = 1e-6
LOWER, UPPER = np.array([-1.5, -1.5, 0.2]), np.array([1.5, 1.5, 1.8])


@pytest.fixture(scope="module")
def chair():
    return surface_of(read(CHAIR, item="samples: 300"))


def around(count, seed=0, radius=1.0):
    """(count, 3) places around an object [m]."""
    rng = np.random.default_rng(seed)
    angle, r = rng.uniform(0.0, 2.0 * math.pi, count), radius * rng.uniform(0.8, 1.2, count)
    return np.stack((r * np.cos(angle), r * np.sin(angle), rng.uniform(0.4, 1.5, count)), axis=1)


def triangles_hit(surface, x, way):
    """How far one ray gets, by all triangles one after the other (Möller and Trumbore)."""
    a, b, c = np.moveaxis(surface.vertices[surface.faces], 1, 0)
    across = np.cross(way, c - a)
    determinant = np.einsum("fd,fd->f", b - a, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.einsum("fd,fd->f", x - a, across) / determinant
        over = np.cross(x - a, b - a)
        v = over @ way / determinant
        t = np.einsum("fd,fd->f", c - a, over) / determinant
    hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0)
    return t[hit].min() if hit.any() else math.inf


def test_rays_see_what_all_triangles_one_by_one_say(chair):
    rng = np.random.default_rng(0)
    x, j = around(300), rng.integers(0, len(chair.points), 300)
    expected = [
        (1.0 - triangles_hit(chair, p, chair.points[k] - p)) * np.linalg.norm(chair.points[k] - p) < 1e-3
        for p, k in zip(x, j, strict=True)
    ]
    np.testing.assert_array_equal(Rays(chair).sees(x, j), expected)
    assert 0.2 < np.mean(expected) < 0.8


def test_without_the_library_the_message_says_what_to_install(chair, monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh.ray.ray_pyembree", None)
    with pytest.raises(PlannerError, match=r"pip install 'ergoflie\[objects\]'"):
        Rays(chair)


def test_a_picture_is_what_rays_spread_over_it_hit(chair):
    """FEO, IV-D1: cast rays all over the cone, and take the points they hit."""
    camera, rays = Camera(CameraFootprint(0.5, grazing=0.5 * math.pi), FacingYaw((0.0, 0.0))), Rays(chair)
    points, normals, face, area = spread(chair.vertices, chair.faces, 100_000)
    fine = replace(chair, points=points, normals=normals, face=face, area=area, share=np.full(len(points), 1e-5))
    x = np.array([[0.9, 0.3, 0.8]])
    k = np.arange(20_000) + 0.5
    cosine, turn = 1.0 - (1.0 - math.cos(0.5)) * k / len(k), 2.399963229728653 * k  # even over solid angles
    axis = camera.axes(x)[0]
    aside = np.cross(axis, [0.0, 0.0, 1.0])
    aside /= np.linalg.norm(aside)
    round_ = np.cos(turn)[:, None] * aside + np.sin(turn)[:, None] * np.cross(axis, aside)
    way = cosine[:, None] * axis + np.sqrt(1.0 - cosine**2)[:, None] * round_
    share = rays.first_hit(np.repeat(x, len(way), axis=0), way)
    hits = (x + share[:, None] * way)[np.isfinite(share)]
    basis = CosineBasis(chair.lower, chair.upper, 4)
    ours = looks(camera, Rays(fine), x)[0]
    weighted = (
        np.einsum("aj,bj,cj,j->abc", *basis.tables(fine.points).cosine.swapaxes(0, 1), ours, optimize=True) / basis.h_k
    )
    by_rays, unweighted = (basis.statistics(basis.tables(x).cosine) for x in (hits, fine.points[ours > 0.0]))
    np.testing.assert_allclose(weighted, by_rays, atol=0.01)
    assert np.abs(unweighted - by_rays).max() > 0.05  # points count by what they take up of the picture
    solid_angle = camera.picture(Rays(fine), x).sum()
    assert solid_angle == pytest.approx(2.0 * math.pi * (1.0 - math.cos(0.5)) * np.isfinite(share).mean(), rel=2e-3)


def test_looks_count_once_and_nothing_is_seen_from_behind():
    surface = surface_of(read(BOX))
    camera = Camera(CameraFootprint(0.5), FacingYaw((0.0, 0.0)))
    seen = looks(camera, Rays(surface), np.array([[1.0, 0.0, 0.3], [-1.0, 0.0, 0.3]]))
    np.testing.assert_allclose(seen.sum(axis=1), 1.0, atol=2e-3)
    assert (seen[0] > 0.0)[surface.normals[:, 0] > 0.9].all()
    assert not (seen[0] > 0.0)[surface.normals[:, 0] < 0.1].any()
    away = Camera(CameraFootprint(0.5), FixedYaw(0.0))
    assert looks(away, Rays(surface), np.array([[1.0, 0.0, 0.3]])).sum() == 0.0


def test_the_near_side_of_a_cloud_hides_the_far_one():
    k = np.arange(800) + 0.5
    z, turn = 1.0 - 2.0 * k / 800, 2.399963229728653 * k
    flat = np.sqrt(1.0 - z * z)
    ball = np.array([0.0, 0.0, 0.5]) + 0.3 * np.stack((flat * np.cos(turn), flat * np.sin(turn), z), axis=1)
    surface = surface_of(read(as_cloud(ball)))
    x = np.array([[1.2, 0.0, 0.5]])
    seen = Camera(CameraFootprint(0.5), FacingYaw((0.0, 0.0))).picture(Rays(surface), x)[0] > 0.0
    towards = (surface.points - [0.0, 0.0, 0.5]) @ [1.0, 0.0, 0.0] / 0.3  # from 0.25 = 0.3/1.2 on it is in sight
    assert seen[towards > 0.5].mean() > 0.95
    assert seen[towards < 0.1].mean() < 0.05


def test_lenses():
    """What is at the edge counts less, what is far counts less, what is seen at a slant does not count."""
    surface = surface_of(read(BOX))
    rays, x, yaw = Rays(surface), np.array([[0.9, 0.5, 0.5]]), FacingYaw((0.0, 0.0))
    plain = Camera(CameraFootprint(0.6), yaw).picture(rays, x)[0]
    rim = Camera(CameraFootprint(0.6, rim=0.5), yaw).picture(rays, x)[0]
    reach = Camera(CameraFootprint(0.6, reach=1.0), yaw).picture(rays, x)[0]
    slant = Camera(CameraFootprint(0.6, grazing=0.7), yaw).picture(rays, x)[0]
    distance = np.linalg.norm(surface.points - x, axis=1)
    np.testing.assert_allclose(reach, plain * np.exp(-0.5 * distance**2))
    assert ((0.5 * plain <= rim) & (rim <= plain)).all()
    assert 0 < np.count_nonzero(slant) < np.count_nonzero(plain)
    low = Camera(CameraFootprint(0.2, pitch=-0.4), yaw).picture(rays, x)[0]
    high = Camera(CameraFootprint(0.2, pitch=0.0), yaw).picture(rays, x)[0]
    assert surface.points[low > 0.0, 2].mean() < surface.points[high > 0.0, 2].mean()


@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_blends_are_means_and_their_derivatives(seed):
    grid = Grid(LOWER, UPPER, (7, 5, 3))
    rng = np.random.default_rng(seed)
    x = rng.uniform(LOWER, UPPER, (20, 3))
    field = rng.standard_normal(len(grid.nodes()))
    value = lambda x: grid.blends(x).gathered(len(x), len(field)) @ field  # noqa: E731
    np.testing.assert_allclose(grid.blends(x).gathered(20, len(field)).sum(axis=1), 1.0)
    np.testing.assert_allclose(grid.blends(x).gathered(20, len(field)) @ grid.nodes(), x, atol=1e-12)  # where we are
    for axis in range(3):
        step = STEP * np.eye(3)[axis]
        numeric = (value(x + step) - value(x - step)) / (2.0 * STEP)
        np.testing.assert_allclose(grid.blends(x).gradient(field[None])[:, axis], numeric, atol=1e-6)


@pytest.fixture(scope="module")
def metric():
    return ergodic_metric(read(STATUE))


def motion(seed=0, steps=30):
    """(T, 2, 3) around the statue."""
    return np.stack([around(steps, seed), around(steps, seed + 1)], axis=1)


def test_ergodicity_is_that_of_its_definition(metric):
    q = motion()
    c_k = metric.statistics(q)
    assert metric.phi_k[0, 0, 0] == pytest.approx(1.0)
    assert metric.value(q) == pytest.approx(np.sum(metric.basis.Lambda_k * (c_k - metric.phi_k) ** 2), rel=1e-9)
    np.testing.assert_allclose(metric.statistics_each(q).mean(axis=0), c_k, atol=1e-12)
    F_k = np.prod(metric.basis.tables(metric.points).cosine[[1, 0, 2], [0, 1, 2]], axis=0) / metric.basis.h_k[1, 0, 2]
    assert c_k[1, 0, 2] == pytest.approx(F_k @ metric.looked_at(q))
    assert metric.phi_k[1, 0, 2] == pytest.approx(F_k @ metric.share)


@pytest.mark.parametrize("camera", ["pitch: 0.0", "rim: 0.3, reach: 1.0, pitch: -0.2"])
def test_gradient(camera):
    metric, q, rng = ergodic_metric(read(STATUE, camera=camera)), motion(), np.random.default_rng(0)
    gradient = metric.evaluate(q).gradient
    for _ in range(5):
        way = rng.standard_normal(q.shape)
        numeric = (metric.value(q + STEP * way) - metric.value(q - STEP * way)) / (2.0 * STEP)
        assert np.vdot(gradient, way) == pytest.approx(numeric, rel=1e-5, abs=1e-9)


def test_several_swarms_at_once_are_as_one_after_the_other(metric):
    swarms = [motion(seed) for seed in (0, 5, 9)]
    E, gradient = metric.evaluate_each(np.stack([q.reshape(-1, 3) for q in swarms]))
    for k, q in enumerate(swarms):
        alone = metric.evaluate(q)
        assert E[k] == pytest.approx(alone.value)
        np.testing.assert_allclose(gradient[k], alone.gradient.reshape(-1, 3), atol=1e-15)


def test_robots_with_cameras_of_their_own(metric):
    other = "cf2, start: [-1.0, 0.1, 0.7], footprint: {type: camera, half_angle: 0.2}"
    mixed = ergodic_metric(read(STATUE, text().replace("cf2, start: [-1.0, 0.1, 0.7]", other)))
    narrow = ergodic_metric(read(STATUE, text().replace("half_angle: 0.5", "half_angle: 0.2")))
    q = motion()
    first, second = (replace(m, views=m.views[:1]) for m in (metric, narrow))
    expected = 0.5 * (first.statistics(q[:, :1]) + second.statistics(q[:, 1:]))
    np.testing.assert_allclose(mixed.statistics(q), expected, atol=1e-12)
    way = np.random.default_rng(0).standard_normal(q.shape)
    numeric = (mixed.value(q + STEP * way) - mixed.value(q - STEP * way)) / (2.0 * STEP)
    assert np.vdot(mixed.evaluate(q).gradient, way) == pytest.approx(numeric, rel=1e-5)


def test_blended_looks_become_those_of_rays_as_the_grid_becomes_finer(chair):
    """E of a motion near viewpoints ever closer together converges to that of rays from where robots are."""
    camera, rays, x = Camera(CameraFootprint(0.5), FacingYaw((0.0, 0.0))), Rays(chair), around(40)
    low, high = np.array([0.5, -0.3, 0.5]), np.array([1.1, 0.3, 1.1])
    x = np.clip(x, low, high)
    exact = looks(camera, rays, x)
    errors = []
    for cells in (3, 6, 12):
        grid = Grid(low, high, (cells,) * 3)
        blended = (
            grid.blends(x).gathered(len(x), len(grid.nodes())) @ Views(grid, looks(camera, rays, grid.nodes())).density
        )
        errors.append(np.abs(blended - exact).sum(axis=1).mean())
    assert errors[1] < 0.75 * errors[0]
    assert errors[2] < 0.75 * errors[1]


def test_what_was_seen_is_told_by_robot():
    mission = read(BOX)
    q = np.repeat(np.array([[[1.0, 0.0, 0.3], [-1.0, 0.0, 0.3]]]), 10, axis=0)
    q[5:, 1] = np.nan
    seen = seen_surface(mission, q)
    surface = surface_of(mission)
    front = surface.normals[:, 0] > 0.9
    np.testing.assert_allclose(seen.seconds[0, front], 1.0)
    np.testing.assert_allclose(seen.seconds[1, surface.normals[:, 0] < -0.9], 0.5)
    assert seen.seconds[0, ~front].max() == 0.0
    assert seen.fraction == pytest.approx(sum(seen.fractions))
    assert seen.fractions[0] == pytest.approx(surface.share[front].sum())
    turned = seen_surface(mission, q, np.zeros((10, 2)))  # both look along x: the first away from it
    assert turned.fractions[0] == 0.0
    assert turned.fractions[1] == seen.fractions[1]
