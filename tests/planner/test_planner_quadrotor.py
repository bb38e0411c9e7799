"""The paper's quadrotor: what a step does to it, controls that follow a point mass, plans within every limit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import missions
from missions import load_mission
from missions.dynamics import CasadiModel, DoubleIntegratorModel
from planner.dynamics.casadi_model import casadi_dynamics
from planner.dynamics.follow import controls_along
from planner.models import has_mass, mission_dynamics
from planner.problem import build_problem
from planner.solver.scaling import scaled_modes
from planner.solver.solve import solve

MISSION = load_mission(Path(missions.__file__).parent / "examples" / "quadrotor_map.yaml")
HOVER = np.array([0.0, 0.0, 0.0, 0.034 * 9.81])


@pytest.fixture(scope="module")
def quadrotor():
    return mission_dynamics(MISSION)


def gentle(steps: int, dt: float):
    """A point mass on a way of some decimetres a second, from rest."""
    t = np.arange(steps) * dt
    u = np.stack([np.cos(0.8 * t), np.sin(1.1 * t), 0.3 * np.sin(0.9 * t)], axis=-1)[:, None] * 0.4
    mission = replace(MISSION, dynamics=DoubleIntegratorModel())
    return mission_dynamics(mission).rollout(u)


def test_at_its_weight_it_hovers(quadrotor):
    motion = quadrotor.rollout(np.tile(HOVER, (*quadrotor.controls_shape[:2], 1)))
    np.testing.assert_allclose(motion.q, np.broadcast_to(quadrotor.start[0, :3], motion.q.shape), atol=1e-9)


def test_a_roll_to_the_right_leads_to_negative_y_and_a_pitch_down_to_positive_x(quadrotor):
    """x forward, y left, z up: the signs of the firmware's attitude, pitch as in the model."""
    u = np.tile(HOVER, (*quadrotor.controls_shape[:2], 1))
    u[..., 0], u[..., 1] = 0.05, 0.1
    q = quadrotor.rollout(u).q[:, 0]
    assert q[20, 0] > q[0, 0] + 0.5
    assert q[20, 1] < q[0, 1] - 0.2


def test_what_a_step_does_is_what_its_sensitivities_say(quadrotor):
    rng = np.random.default_rng(0)
    u = HOVER + 0.1 * rng.standard_normal(quadrotor.controls_shape)
    over, by = quadrotor.sensitivities(u)
    x, h = quadrotor.at_steps(u)[40], 1e-6
    dx, du = rng.standard_normal((1, 9)), rng.standard_normal((1, 4))
    ahead, behind = (quadrotor.advance(x + sign * h * dx, u[40] + sign * h * du) for sign in (1.0, -1.0))
    expected = over[40] @ dx[..., None] + by[40] @ du[..., None]
    np.testing.assert_allclose((ahead - behind) / (2.0 * h), expected[..., 0], atol=1e-6)


def test_it_follows_a_point_mass_within_its_limits(quadrotor):
    target = gentle(MISSION.steps, MISSION.horizon.dt)
    u = controls_along(quadrotor, target)
    motion = quadrotor.rollout(u)
    assert np.abs(motion.q - target.q).max() <= 0.01
    assert np.all((u >= quadrotor.lower) & (u <= quadrotor.upper))


def test_searches_begin_with_a_point_mass_only_where_controls_change_velocities():
    drive = CasadiModel(("x", "y", "a"), ("v", "w"), ("v * cos(a)", "v * sin(a)", "w"), (0.0, -1.0), (0.5, 1.0))
    assert has_mass(mission_dynamics(MISSION))
    assert build_problem(MISSION).coarse.dynamics.controls_shape == (MISSION.steps, 1, 3)
    assert not has_mass(casadi_dynamics(drive, np.zeros((1, 2)), 5, 0.1))


def test_modes_hold_any_controls_and_are_scaled_by_what_controls_do(quadrotor):
    modes = scaled_modes(build_problem(MISSION))
    u = HOVER + 0.1 * np.random.default_rng(1).standard_normal(quadrotor.controls_shape)
    np.testing.assert_allclose(modes.controls(modes.variables(u)), u, atol=1e-9)
    moved = []
    for control in range(4):
        z = np.zeros((modes.count, 1, 4))
        z[0, 0, control] = 1e-3  # all the time
        still = quadrotor.rollout(modes.controls(0.0 * z)).q
        moved.append(np.abs(quadrotor.rollout(modes.controls(z)).q - still).max())
    roll, pitch, yaw, thrust = moved
    assert max(roll, pitch, thrust) < 3.0 * min(roll, pitch, thrust)  # [m]
    assert yaw < 1e-9


def test_a_plan_meets_every_limit_of_the_model():
    mission = replace(MISSION, horizon=replace(MISSION.horizon, duration=5.0))
    model = mission.dynamics
    assert isinstance(model, CasadiModel)
    outcome = solve(build_problem(mission), replace(mission.solver, time_limit=120.0, starts=2))
    plan = outcome.plan
    assert plan is not None
    slack = 0.005 * (np.array(model.upper) - model.lower)  # the tolerance controls are planned with
    assert np.all(plan.u >= model.lower - slack)
    assert np.all(plan.u <= model.upper + slack)
    assert plan.q[..., 2].min() >= 0.1 - 1e-3
    assert plan.q[..., 2].max() <= 0.5 + 1e-3
    assert np.linalg.norm(plan.v, axis=-1).max() <= 0.5 * 1.01
    np.testing.assert_allclose(mission_dynamics(mission).rollout(plan.u).q, plan.q, atol=1e-12)
    assert any(entry.phase.startswith("coarse") for entry in outcome.history)  # it began with a point mass
