"""Searches around an object: the stand-off as search and certificate see it, and a small mission to certified bytes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.certificate.certify import certify
from planner.certificate.standoff import farthest
from planner.constraints.standoff import NearSurface
from planner.dynamics import Cotangent, Motion
from planner.indicators import ergodic_metric
from planner.pareto.front import Maps
from planner.pipeline import make_flight_plan
from planner.problem import build_problem
from planner.surface.mission import surface_of
from planner.surface.seen import seen_surface
from planner.trajectory.encode import decode
from planner.trajectory.piecewise import PiecewisePolynomial
from tests.planner.objects_bench import BOX, STATUE, read, text

STEP = 1e-6


def random_flight(seed):
    """Three pieces within a metre or two of the origin."""
    rng = np.random.default_rng(seed)
    coefficients = rng.uniform(-1.0, 1.0, (3, 4, 8)) * 0.6 ** np.arange(8)
    return PiecewisePolynomial(rng.uniform(0.5, 2.0, 3), coefficients)  # with leaps at its joints


@settings(max_examples=30)
@given(st.integers(0, 10_000))
def test_nobody_is_ever_farther_than_the_certificate_says(seed):
    flown, points = random_flight(seed), np.random.default_rng(seed).uniform(-0.3, 0.3, (40, 3))
    found = farthest(flown, points)
    t = np.linspace(0.0, flown.duration, 4000)
    sampled = np.linalg.norm(flown.evaluate(t)[:, None, :3] - points, axis=-1).min(axis=1)
    assert -found.bound[0] >= sampled.max() - 1e-9
    assert found.attained[0] - found.bound[0] <= 1e-4 + 1e-9
    there = flown.evaluate(found.time + np.array([-1e-9, 1e-9]))[:, :3]  # on both sides of a joint
    reached = np.linalg.norm(there[:, None] - points, axis=-1).min(axis=-1).max()
    assert reached == pytest.approx(-found.attained[0], abs=1e-6)


def test_gradient_of_the_stand_off():
    rng = np.random.default_rng(0)
    near = NearSurface(rng.uniform(-0.3, 0.3, (40, 3)), np.array([0.5, 0.7]), ("a", "b"), 0.1)
    q = rng.uniform(-1.0, 1.0, (12, 2, 3))
    motion = Motion(q, np.zeros_like(q), np.zeros((11, 2, 3)), np.zeros((23, 2, 3)), *())
    weights, way = rng.uniform(0.0, 1.0, (12, 2)), rng.standard_normal(q.shape)
    cotangent = Cotangent.zeros_like(motion)
    near.evaluate(motion).pull(weights, cotangent)
    ahead, behind = (near.evaluate(motion._replace(q=q + s * way)).residual for s in (STEP, -STEP))
    assert np.vdot(cotangent.q, way) == pytest.approx(np.vdot(weights, ahead - behind) / (2.0 * STEP), rel=1e-6)
    double = near.stacked(2, 2)
    twice = double.evaluate(motion._replace(q=np.concatenate((q, q), axis=1))).residual
    np.testing.assert_array_equal(twice, np.concatenate([near.evaluate(motion).residual] * 2, axis=1))


def test_a_problem_asks_for_the_stand_off_only_if_the_mission_does():
    names = [{c.name for c in build_problem(read(BOX, item=item)).constraints} for item in ("far: 1.2", "samples: 200")]
    assert "stand-off" in names[0]
    assert "stand-off" not in names[1]
    assert {"obstacle clearance", "separation"} <= names[1]


@pytest.fixture(scope="module")
def flown():
    return make_flight_plan(read(STATUE, item="samples: 200, far: 1.2"))


def test_a_search_around_an_object_is_certified(flown):
    checks = {check.name: check for check in flown.certificate.checks}
    assert flown.certificate.passed
    assert {"stand-off", "obstacles", "take-off obstacles", "landing obstacles", "yaw rate"} <= checks.keys()
    assert checks["obstacles"].where.endswith("object")
    start = np.array([[robot.start for robot in flown.mission.robots]] * len(flown.plan.q))
    assert flown.certificate.indicators.ergodicity < 0.1 * ergodic_metric(flown.mission).value(start)


def test_its_bytes_keep_their_distance_and_face_the_object(flown):
    surface = surface_of(flown.mission)
    t = np.linspace(0.0, flown.mission.horizon.duration, 400)
    for encoded in flown.trajectories.values():
        x = decode(encoded).evaluate(t)
        distance = np.linalg.norm(x[:, None, :3] - surface.points, axis=-1).min(axis=1)
        assert distance.min() >= 0.3 - 1e-3
        assert distance.max() <= 1.2 + 1e-3
        wanted = np.arctan2(*(np.array(surface.centre) - x[:, :2]).T[::-1])
        assert np.abs(np.angle(np.exp(1j * (x[:, 3] - wanted)))).max() < 0.25


def test_bytes_that_come_too_close_or_go_too_far_fail(flown):
    def failures(mission):
        return {check.name for check in certify(mission, flown.trajectories, flown.transfers).failures}

    assert failures(flown.mission) == set()
    item = text(item="samples: 200, far: 1.2")
    assert "stand-off" in failures(read(STATUE, item.replace("far: 1.2", "far: 0.86")))
    assert "obstacles" in failures(read(STATUE, item.replace("near: 0.3", "near: 0.6")))


def test_more_is_seen_by_two_than_by_one(flown):
    seen = seen_surface(flown.mission, flown.plan.q[:-1])
    assert seen.fraction > max(seen.fractions)
    assert seen.fraction > 0.7


def test_fronts_are_not_for_objects():
    with pytest.raises(Exception, match="a front of plans that look at an object"):
        Maps.of(read(BOX))
