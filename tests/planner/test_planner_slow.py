"""Robots are slow where their legs meet, and only where the certificate asks for it."""

import dataclasses

import numpy as np
import pytest

from missions.radio import Radio
from missions.schema import TrajectorySettings
from planner import pipeline
from planner.certificate.switching import Switch
from planner.constraints.speed import Speed
from planner.dynamics import Cotangent
from planner.margins import Margins, SlowPoint
from planner.problem import build_problem
from planner.slow import AROUND, SLOWEST, slow_points, speed_limits
from planner.solver.methods import solve
from tests.planner.problems import small

MISSION = small(radio=Radio(jitter=0.02, switch_jump=0.01))  # 40 ms: 0.25 m/s at a switch
SWITCHES = [
    Switch(robot=0, leg=1, time=2.0, speed=0.5, jump=0.02),
    Switch(robot=0, leg=2, time=5.0, speed=0.1, jump=0.004),
    Switch(robot=1, leg=1, time=3.0, speed=0.2, jump=0.008),
]


def test_only_a_robot_that_is_too_fast_slows_down_but_at_all_its_switches():
    first, second = slow_points(MISSION, SWITCHES)
    assert (first.robot, first.time, second.time) == (0, 2.0, 5.0)
    assert first.speed == pytest.approx(0.8 * 0.25)
    assert slow_points(MISSION, SWITCHES[1:]) == ()
    hopeless = dataclasses.replace(SWITCHES[0], speed=0.1, jump=9.0)
    assert slow_points(MISSION, [hopeless])[0].speed == SLOWEST


def test_limits_are_low_around_the_switch_of_that_robot():
    assert speed_limits(MISSION, Margins()).shape == (2,)
    limits = speed_limits(MISSION, Margins(slow=(SlowPoint(1, 3.0, 0.2), SlowPoint(1, 3.5, 0.1))))
    usual = speed_limits(MISSION, Margins())[0]
    t = np.arange(MISSION.steps + 1) * MISSION.horizon.dt
    assert (limits[:, 0] == usual).all()
    assert (limits[np.abs(t - 3.5) < AROUND - 0.01, 1] == 0.1).all()
    assert limits[np.argmin(np.abs(t - 2.5)), 1] == 0.2
    assert (limits[(t < 2.3) | (t > 4.2), 1] == usual).all()


def test_a_limit_by_step_pulls_as_its_residual_changes():
    problem = build_problem(MISSION, Margins(slow=(SlowPoint(0, 4.0, 0.2),)))
    speed = next(item for item in problem.constraints if isinstance(item, Speed))
    rng = np.random.default_rng(0)
    motion = problem.dynamics.rollout(0.2 * rng.standard_normal(problem.dynamics.controls_shape))
    residual, pull = speed.evaluate(motion)
    weights, direction = rng.standard_normal(residual.shape), rng.standard_normal(motion.v.shape)
    cotangent = Cotangent.zeros_like(motion)
    pull(weights, cotangent)
    ahead, behind = (speed.evaluate(motion._replace(v=motion.v + h * direction)).residual for h in (1e-6, -1e-6))
    assert np.vdot(cotangent.v, direction) == pytest.approx(np.vdot(weights, ahead - behind) / 2e-6, rel=1e-6)
    both = speed.stacked(2, 2)
    assert np.array_equal(both.limit, np.concatenate([speed.limit, speed.limit], axis=1))


def test_the_plan_is_slow_there():
    outcome = solve(build_problem(MISSION, Margins(slow=(SlowPoint(0, 4.0, 0.05),))), MISSION.solver)
    speed = np.linalg.norm(outcome.plan.v[:, 0], axis=1)
    near = np.abs(outcome.plan.t - 4.0) <= AROUND
    assert speed[near].max() <= 0.051
    assert speed.max() > 0.2


def test_the_pipeline_slows_robots_down_until_their_switches_are_certified(monkeypatch):
    """Halves of 3 pieces, so that eight seconds are several legs."""
    monkeypatch.setattr("planner.trajectory.legs.HALF", 3 * 132)
    monkeypatch.setattr("planner.trajectory.legs.MAX_PIECES", 4)
    monkeypatch.setattr("planner.trajectory.legs.SHORTEST_LEG", 1.0)
    monkeypatch.setattr("planner.certificate.switching.UPLOAD_SLACK", 0.0)
    margins = []

    def built(mission, given, **more):
        margins.append(given)
        return build_problem(mission, given, **more)

    monkeypatch.setattr(pipeline, "build_problem", built)
    mission = small(
        trajectory=TrajectorySettings(encoding="poly4d"),
        radio=Radio(jitter=0.02, switch_jump=0.008, packet_rate=5000.0),
    )
    done = pipeline.make_flight_plan(mission)
    worst = next(check for check in done.certificate.checks if check.name == "switch jump")
    assert worst.passed
    assert min(len(encoded.legs) for encoded in done.trajectories.values()) > 1
    assert any(given.slow for given in margins)
