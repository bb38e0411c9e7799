"""Footprints: against brute force, against each other, and as they shrink (FEO)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.ergodic.basis import CosineBasis
from planner.ergodic.metric import ErgodicMetric
from planner.footprint.clipped import ClippedDisc
from planner.footprint.disc import DiscFootprint, disc_factor
from planner.footprint.lattice import LatticeFootprint
from planner.footprint.metric import FootprintMetric
from planner.footprint.outline import Disc, Window
from planner.footprint.point import Point
from planner.footprint.polar import PolarFootprint
from planner.footprint.tilt import TiltedCone
from planner.footprint.window import WindowFootprint

BASIS = CosineBasis(np.array([0.0, -1.0]), np.array([1.3, 0.7]))
STEP, DT = 1e-6, 0.2
FOOTPRINTS = {
    "point": Point(),
    "disc": DiscFootprint(Disc(slope=0.3)),
    "disc with weights": DiscFootprint(Disc(slope=0.3), rim=0.2),
    "disc of one size": DiscFootprint(Disc(radius=0.1)),
    "disc over the edge": DiscFootprint(Disc(slope=1.0)),
    "clipped disc": ClippedDisc(Disc(slope=1.0)),
    "disc over all edges": ClippedDisc(Disc(slope=4.0)),
    "polar": PolarFootprint(Disc(slope=0.3)),
    "polar with weights, over the edge": PolarFootprint(Disc(slope=1.0), rim=0.3),
    "window": WindowFootprint((0.4, 0.2)),
    "window over the edge": WindowFootprint((1.4, 1.2)),
    "turned window": PolarFootprint(Window((0.4, 0.2), yaw=0.5)),
    "lattice": LatticeFootprint(Disc(slope=0.3)),
    "tilted cone": PolarFootprint(TiltedCone(0.4, DT)),
    "tilted cone over the edge": PolarFootprint(TiltedCone(0.9, DT)),
}


def gentle_motion(seed: int, robots: int = 2, steps: int = 20) -> np.ndarray:
    """(T, N, 3) inside the workspace, with accelerations of a few m/s²."""
    rng = np.random.default_rng(seed)
    t = np.arange(steps) * DT
    phase, rate = rng.uniform(0.0, 2.0 * math.pi, (2, robots, 3)), rng.uniform(0.5, 2.0, (robots, 3))
    swing = np.cos(t[:, None, None] * rate + phase[0])
    return np.array([0.65, -0.15, 0.45]) + np.array([0.3, 0.4, 0.25]) * swing


def metric(footprint: object, seed: int = 0) -> FootprintMetric:
    phi_k = 0.1 * np.random.default_rng(seed).standard_normal((10, 10))
    return FootprintMetric(BASIS, phi_k, (footprint, footprint))  # type: ignore[arg-type]


def brute_force(inside, x: np.ndarray, cells: int = 2200) -> np.ndarray:
    """c_k of a uniform footprint by counting cells of the workspace."""
    side = BASIS.upper - BASIS.lower
    axes = [BASIS.lower[d] + side[d] * (np.arange(cells) + 0.5) / cells for d in range(2)]
    seen = inside(*np.meshgrid(*axes, indexing="ij"), x).astype(float)
    k = np.arange(BASIS.n) * np.pi
    C = [np.cos(np.outer(k, (axis - low) / s)) for axis, low, s in zip(axes, BASIS.lower, side, strict=True)]
    return C[0] @ seen @ C[1].T / (seen.sum() * BASIS.h_k)


@pytest.mark.parametrize("footprint", FOOTPRINTS.values(), ids=list(FOOTPRINTS))
def test_gradient(footprint):
    there, q = metric(footprint), gentle_motion(1)
    value, gradient = there.evaluate(q)
    assert value == pytest.approx(there.value(q), rel=1e-12)
    direction = np.random.default_rng(2).standard_normal(q.shape)
    numeric = (there.value(q + STEP * direction) - there.value(q - STEP * direction)) / (2.0 * STEP)
    assert abs(numeric - np.vdot(gradient, direction)) <= 1e-7 * np.linalg.norm(gradient) * np.linalg.norm(direction)


@pytest.mark.parametrize("footprint", FOOTPRINTS.values(), ids=list(FOOTPRINTS))
def test_whoever_looks_looks_once(footprint):
    assert metric(footprint).statistics(gentle_motion(3))[0, 0] == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("footprint", FOOTPRINTS.values(), ids=list(FOOTPRINTS))
def test_steps_by_themselves_are_those_of_the_whole(footprint):
    """A camera that is fixed to the body is tilted at a step of a motion, too."""
    there, q = metric(footprint), gentle_motion(8)
    np.testing.assert_allclose(there.statistics_each(q).mean(axis=0), there.statistics(q), atol=1e-12)


@pytest.mark.parametrize("x", [(0.6, -0.2, 0.5), (0.1, -0.2, 0.5), (1.2, 0.6, 0.6)], ids=["inside", "edge", "corner"])
def test_discs_as_counted(x):
    def inside(a, b, x):
        return np.hypot(a - x[0], b - x[1]) <= 0.4 * x[2]

    counted = brute_force(inside, np.array(x))
    disc = Disc(slope=0.4)
    for footprint in (DiscFootprint(disc), ClippedDisc(disc), PolarFootprint(disc, directions=256, rings=10)):
        np.testing.assert_allclose(footprint.look(BASIS, np.array(x)[None, None]).c_k, counted, atol=2e-3)


@pytest.mark.parametrize("x", [(0.6, -0.2, 0.5), (0.1, -0.9, 0.5)], ids=["inside", "corner"])
def test_windows_as_counted(x):
    def inside(a, b, x):
        return (np.abs(a - x[0]) <= 0.5 * x[2]) & (np.abs(b - x[1]) <= 0.3 * x[2])

    counted = brute_force(inside, np.array(x))
    for footprint in (WindowFootprint((0.5, 0.3)), PolarFootprint(Window((0.5, 0.3)), directions=512, rings=10)):
        np.testing.assert_allclose(footprint.look(BASIS, np.array(x)[None, None]).c_k, counted, atol=3e-3)


def test_tilted_cones_as_counted():
    """The rays within the angle of the body's axis, one by one; 3 m/s² tilt by 17 degrees."""
    x = np.tile(np.array([0.65, -0.15, 0.5]), (3, 1, 1)) + 0.5 * 3.0 * (np.arange(3) * DT)[:, None, None] ** 2 * [
        1,
        0,
        0,
    ]
    acceleration = np.diff(np.concatenate(([x[0]], x, [x[-1]])), 2, axis=0)[1, 0] / DT**2
    axis = -(acceleration + np.array([0.0, 0.0, 9.81]))
    axis /= np.linalg.norm(axis)

    def inside(a, b, here):
        ray = np.stack((a - here[0], b - here[1], np.full_like(a, -here[2])), axis=-1)
        return ray @ axis >= math.cos(0.4) * np.linalg.norm(ray, axis=-1)

    cone = PolarFootprint(TiltedCone(0.4, DT), directions=128, rings=10)
    whole = cone.outline.cast(x, 2.0 * np.pi * (np.arange(128) + 0.5) / 128)
    assert whole.radius.shape == (3, 128)
    one = PolarFootprint(_Frozen(whole.centre[1], whole.radius[1]), directions=128, rings=10)
    np.testing.assert_allclose(one.look(BASIS, x[1:2]).c_k, brute_force(inside, x[1, 0]), atol=2e-3)


class _Frozen:
    """One outline as it was."""

    def __init__(self, centre, radius):
        self.centre, self.radius = centre[None], radius[None]

    def cast(self, x, direction):
        from planner.footprint.outline import Cast

        return Cast(self.centre, self.radius, lambda by_centre, by_radius: np.zeros_like(x))


@settings(max_examples=25)
@given(st.floats(0.0, 1.0), st.integers(0, 100))
def test_closed_form_and_quadrature_agree_inside(rim, seed):
    x = gentle_motion(seed) * [0.5, 0.5, 0.5] + [0.3, -0.1, 0.2]
    rim = max(rim, 0.05)
    closed = DiscFootprint(Disc(slope=0.3), rim).look(BASIS, x).c_k
    np.testing.assert_allclose(closed, PolarFootprint(Disc(slope=0.3), rim, 64, 12).look(BASIS, x).c_k, atol=1e-9)


def test_the_papers_samples_come_near():
    x = gentle_motion(4) * [0.5, 0.5, 0.5] + [0.3, -0.1, 0.2]
    exact = DiscFootprint(Disc(slope=0.3)).look(BASIS, x).c_k
    errors = [
        float(np.abs(LatticeFootprint(Disc(slope=0.3), spacing).look(BASIS, x).c_k - exact).max())
        for spacing in (0.35, 0.02)
    ]
    assert len(LatticeFootprint(Disc(slope=0.3)).offsets) == 25
    assert errors[1] < 2e-3 < 10.0 * errors[0]


@pytest.mark.parametrize("shape", ["disc", "polar", "window", "lattice", "tilted cone"])
def test_small_footprints_are_points(shape):
    """FEO, Theorem 1: E of a footprint converges to the ordinary one, as the square of its size."""
    q, phi_k = gentle_motion(5), metric(Point()).phi_k
    ordinary = ErgodicMetric(BASIS, phi_k).value(q[..., :2])
    assert metric(Point()).value(q) == pytest.approx(ordinary, rel=1e-12)
    gaps = []
    for size in (0.02, 0.01):
        footprint = {
            "disc": DiscFootprint(Disc(slope=size)),
            "polar": PolarFootprint(Disc(slope=size)),
            "window": WindowFootprint((size, size)),
            "lattice": LatticeFootprint(Disc(slope=size)),
            "tilted cone": PolarFootprint(TiltedCone(math.atan(size), 1e6)),  # so slow that it is level
        }[shape]
        gaps.append(abs(metric(footprint).value(q) - ordinary))
    assert gaps[1] < 1e-3 * ordinary
    assert gaps[0] / gaps[1] == pytest.approx(4.0, rel=0.05)


def test_layers_look_from_their_heights():
    q = gentle_motion(6)[..., :2]
    heights = np.array([0.3, 0.6])
    flat = FootprintMetric(BASIS, np.zeros((10, 10)), (DiscFootprint(Disc(slope=0.3)),) * 2, 0.1, heights)
    there = np.concatenate((q, np.broadcast_to(heights - 0.1, q.shape[:2])[..., None]), axis=-1)
    np.testing.assert_allclose(flat.statistics(q), metric(DiscFootprint(Disc(slope=0.3))).statistics(there), atol=1e-12)
    assert flat.evaluate(q).gradient.shape == q.shape


def test_robots_with_different_footprints_count_alike():
    q = gentle_motion(7)
    wide, narrow = DiscFootprint(Disc(slope=0.5)), Point()
    both = FootprintMetric(BASIS, np.zeros((10, 10)), (wide, narrow))
    mean = 0.5 * (wide.look(BASIS, q[:, :1]).c_k + narrow.look(BASIS, q[:, 1:]).c_k)
    np.testing.assert_allclose(both.statistics(q), mean, atol=1e-14)
    direction = np.random.default_rng(0).standard_normal(q.shape)
    numeric = (both.value(q + STEP * direction) - both.value(q - STEP * direction)) / (2.0 * STEP)
    assert numeric == pytest.approx(np.vdot(both.evaluate(q).gradient, direction), rel=1e-5)


def test_whoever_leaves_the_workspace_looks_from_its_edge():
    footprint = PolarFootprint(Disc(slope=0.3))
    beyond, edge = np.array([[[1.5, 0.0, 0.5]]]), np.array([[[1.3, 0.0, 0.5]]])
    np.testing.assert_allclose(footprint.look(BASIS, beyond).c_k, footprint.look(BASIS, edge).c_k, atol=1e-12)


def test_a_point_has_the_factor_one():
    assert disc_factor(np.array([0.0, 1e-9])) == pytest.approx([1.0, 1.0])
    assert disc_factor(np.array([0.0]), rim=0.5) == pytest.approx([1.0])


def test_factors_are_bessel_functions():
    from scipy.special import j0, j1

    z = np.linspace(0.01, 60.0, 300)
    np.testing.assert_allclose(disc_factor(z), 2.0 * j1(z) / z, atol=1e-14)
    s = (np.arange(4000) + 0.5) / 4000
    weight = s * 0.3 ** (s**2)
    weighted = j0(z[:, None] * s) @ weight / weight.sum()
    np.testing.assert_allclose(disc_factor(z, rim=0.3), weighted, atol=2e-6)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Disc(),
        lambda: Disc(radius=-0.1, slope=1.0),
        lambda: Window((0.0, 0.1)),
        lambda: WindowFootprint((0.1, 0.0)),
        lambda: PolarFootprint(Disc(radius=0.1), rim=0.0),
        lambda: TiltedCone(0.0, 0.1),
        lambda: TiltedCone(0.5, 0.0),
    ],
)
def test_shapes_that_are_none(make):
    with pytest.raises(ValueError, match="got"):
        make()
