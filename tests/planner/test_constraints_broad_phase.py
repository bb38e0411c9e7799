"""Closest approaches in continuous time: within steps, and of blocks of steps that are only bounded."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.shapes import Solid
from planner.connectivity.pairs import all_pairs
from planner.constraints import separation
from planner.constraints.blocks import BLOCK, box_gaps
from planner.constraints.obstacles import Obstacles
from planner.constraints.paths import Paths, When, closest, shares
from planner.constraints.separation import Separation
from planner.constraints.solids import Outside
from planner.dynamics import Cotangent, DoubleIntegrator

DENSE = np.linspace(0.0, 1.0, 2001)
NAMES = tuple(map(str, range(40)))


def swarm(robots, steps, side, seed, nu=2, dt=1.0, push=0.5):
    """A motion under random controls from random starts."""
    rng = np.random.default_rng(seed)
    dynamics = DoubleIntegrator(rng.uniform(0.0, side, (robots, nu)), steps, dt)
    return dynamics.rollout(rng.uniform(-push, push, dynamics.controls_shape))


def constraint(robots, scale=None):
    pairs = all_pairs(robots)
    return Separation(pairs, np.full(len(pairs), 0.3), NAMES[:robots], 1.0, scale)


def everywhere(motion, s=DENSE):
    """Positions (ν, N, K, len(s)) of every robot all through every step, from the dynamics."""
    dt = 1.0
    tau = s * dt
    q = motion.q[:-1].T[..., None] + motion.v[:-1].T[..., None] * tau + 0.5 * motion.u.T[..., None] * tau**2
    return q


def dense(start, middle, end, s=DENSE):
    """Squared distances (len(s),) of a path to the origin."""
    path = np.einsum("sk,sd->dk", shares(s), np.stack([start, middle, end]))
    return (path**2).sum(axis=0)


@given(st.lists(st.floats(-2.0, 2.0), min_size=6, max_size=6), st.sampled_from([4, 16]))
@settings(max_examples=200, deadline=None)
def test_the_closest_approach_is_on_the_path_and_never_farther_than_where_it_was_looked_for(numbers, points):
    start, middle, end = np.array(numbers).reshape(3, 2)
    found = closest(np.stack([start, middle, end]), points)
    assert found.squares <= dense(start, middle, end, np.linspace(0.0, 1.0, points + 1)).min() + 1e-9
    assert found.squares == pytest.approx(dense(start, middle, end, np.array([float(found.s)]))[0], abs=1e-9)


@given(st.lists(st.floats(-2.0, 2.0), min_size=4, max_size=4), st.lists(st.floats(-0.1, 0.1), min_size=2, max_size=2))
@settings(max_examples=200, deadline=None)
def test_what_bends_little_is_never_closer_than_what_is_found(numbers, bend):
    start, end = np.array(numbers).reshape(2, 2)
    middle = 0.5 * (start + end) + np.linalg.norm(end - start) * np.array(bend)
    assert closest(np.stack([start, middle, end])).squares <= dense(start, middle, end).min() + 1e-6


def test_closest_approaches_where_nothing_moves_or_paths_are_straight():
    still = np.array([0.3, 0.4])
    assert closest(np.stack([still] * 3)).squares == pytest.approx(0.25)
    passing = closest(np.array([[-1.0, 0.2], [0.5, 0.2], [2.0, 0.2]]))
    assert (passing.squares, passing.s) == (pytest.approx(0.04), pytest.approx(1.0 / 3.0))


@given(st.integers(0, 1000), st.integers(2, 8), st.integers(1, 40), st.floats(0.1, 5.0))
@settings(max_examples=50, deadline=None)
def test_boxes_are_never_farther_apart_than_what_is_in_them(seed, robots, steps, side):
    motion = swarm(robots, steps, side, seed)
    low, high = Paths.of(motion).boxes(BLOCK)
    i, j = all_pairs(robots).T
    gaps = np.repeat(box_gaps(low[:, i], high[:, i], low[:, j], high[:, j]), BLOCK, axis=1)[:, :steps]
    x = everywhere(motion, np.linspace(0.0, 1.0, 21))
    squares = ((x[:, i] - x[:, j]) ** 2).sum(axis=0)
    assert (gaps[..., None] <= squares + 1e-9).all()


@pytest.mark.parametrize(("scale", "nu"), [(None, 2), (np.array([1.0, 1.0, 0.4]), 3)])
def test_separation_holds_between_samples(scale, nu):
    """Of a second a step, at metres a second: samples would jump over each other."""
    motion = swarm(12, 30, 4.0, 5, nu)
    tested = constraint(12, scale)
    x = everywhere(motion) * (1.0 if scale is None else scale[:, None, None, None])
    i, j = tested.pairs.T
    exact = 0.3 - np.sqrt(((x[:, i] - x[:, j]) ** 2).sum(axis=0).min(axis=-1))
    violation = tested.violation(motion)
    close = exact > -0.14
    assert close.sum() > 3
    np.testing.assert_allclose(violation[close], exact[close], atol=2e-3)
    assert (violation >= exact - 1e-9).all()  # never too hopeful
    at_samples = dataclasses.replace(tested, when=When.SAMPLES).violation(motion)
    assert at_samples.max() < violation.max() - 0.01


def test_what_is_far_is_the_same_far_away_and_pulls_nobody():
    motion = swarm(20, 60, 5.0, 5, push=0.1)
    tested = constraint(20)
    x = everywhere(motion, np.linspace(0.0, 1.0, 101))
    i, j = tested.pairs.T
    exact = np.sqrt(((x[:, i] - x[:, j]) ** 2).sum(axis=0).min(axis=-1))
    residual, pull = tested.evaluate(motion)
    far = exact > separation.FAR * 0.3 + 0.05
    assert 0.5 < far.mean() < 1.0
    np.testing.assert_allclose(residual[far], 0.5 * 0.3 * (1.0 - separation.FAR**2), rtol=1e-12)
    cotangent = Cotangent.zeros_like(motion)
    pull(far.astype(float), cotangent)
    assert not cotangent.q_fine.any()


def test_circles_are_kept_clear_of_between_samples():
    motion = swarm(6, 30, 4.0, 3)
    center = np.array([[1.0, 2.0], [3.0, 0.5]])
    tested = Obstacles(center, np.full((6, 2), 0.4), NAMES[:6], 1.0)
    way = everywhere(motion)[:, :, None] - center.T[:, None, :, None, None]
    exact = 0.4 - np.sqrt((way**2).sum(axis=0).min(axis=-1))
    violation = tested.violation(motion)
    close = exact > -0.19
    assert (exact > 0.0).any()
    np.testing.assert_allclose(violation[close], exact[close], atol=2e-3)
    assert (violation >= exact - 1e-9).all()


def test_solids_are_kept_clear_of_between_samples():
    motion = swarm(6, 30, 4.0, 3)
    body = Solid(np.array([[1.0, 1.0], [2.5, 1.2], [1.8, 2.4]]))
    x = everywhere(motion)
    exact = -body.value(np.concatenate([x, np.zeros((1, *x.shape[1:]))])).min(axis=-1)
    violations = {}
    for looks in (2, 64):
        tested = Outside(body, np.arange(6), np.zeros(6), "it", NAMES[:6], 1.0, looks)
        violations[looks] = tested.violation(motion)
    close = exact > -0.1
    assert (exact > 0.0).any()
    assert np.abs(violations[64] - exact)[close].max() < 0.02 < np.abs(violations[2] - exact)[close].max()


@pytest.mark.parametrize("what", ["pairs", "circles"])
def test_chords_miss_no_more_than_paths_bend_and_pull_as_they_say(what):
    motion = swarm(12, 30, 4.0, 5)
    if what == "pairs":
        tested, bend = dataclasses.replace(constraint(12), when=When.CHORDS), 2.0 * 0.5 * math.sqrt(2.0) * 0.25 / 8.0
    else:
        center, radius = np.array([[1.0, 2.0], [3.0, 0.5]]), np.full((12, 2), 0.4)
        tested, bend = Obstacles(center, radius, NAMES[:12], 1.0, When.CHORDS), 0.5 * math.sqrt(2.0) * 0.25 / 8.0
    exact = dataclasses.replace(tested, when=When.ALWAYS).violation(motion)
    halves = tested.violation(motion)
    chords = halves.reshape(*exact.shape, 2).max(axis=-1)  # of the two halves of a step
    close = exact > -0.1
    assert close.sum() > 3
    assert np.abs(chords - exact)[close].max() <= bend + 1e-9
    assert chords[close].max() > dataclasses.replace(tested, when=When.SAMPLES).violation(motion).max() + 0.01

    residual, pull = tested.evaluate(motion)
    weights = np.where(residual > -0.05, np.random.default_rng(0).uniform(0.0, 1.0, residual.shape), 0.0)
    cotangent = Cotangent.zeros_like(motion)
    pull(weights, cotangent)
    along = np.random.default_rng(1).standard_normal(motion.q_fine.shape)
    h = 1e-6
    ends = [tested.evaluate(motion._replace(q_fine=motion.q_fine + sign * h * along)).residual for sign in (1.0, -1.0)]
    slope = float((weights * (ends[0] - ends[1])).sum()) / (2.0 * h)
    assert slope == pytest.approx(float((cotangent.q_fine * along).sum()), rel=1e-5)
