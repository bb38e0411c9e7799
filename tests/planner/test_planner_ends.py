"""Given ends and starts in motion hold for every value of the variables: they are built in, not searched for."""

import dataclasses

import numpy as np
import pytest

from missions import fleet
from missions.schema import NoConnectivity, Robot
from planner.dynamics import DoubleIntegrator, SingleIntegrator
from planner.errors import PlannerError, UnreachableError
from planner.feasibility import check_feasible
from planner.problem import build_problem
from planner.solver.ends import with_ends
from planner.solver.modes import Weights, control_modes
from planner.solver.scaling import scaled_modes
from tests.planner.problems import furnished, imec, layered, small


def random_variables(problem, modes, seed=0):
    _, robots, nu = problem.dynamics.controls_shape
    return 2.0 * np.random.default_rng(seed).standard_normal((modes.S.shape[1], robots, nu))


@pytest.mark.parametrize("mission", [furnished(), layered()], ids=lambda m: m.name)
@pytest.mark.parametrize("seed", range(3))
def test_every_motion_starts_and_ends_as_given(mission, seed):
    problem = build_problem(mission)
    modes = scaled_modes(problem)
    motion = problem.dynamics.rollout(modes.controls(random_variables(problem, modes, seed)))
    given = np.isfinite(fleet.ends(mission))
    assert given.any()
    assert not given.all()
    np.testing.assert_array_equal(motion.q[0], fleet.starts(mission))
    np.testing.assert_array_equal(motion.v[0], fleet.velocities(mission))
    np.testing.assert_allclose(motion.q[-1][given], fleet.ends(mission)[given], atol=1e-10)
    np.testing.assert_allclose(motion.v[-1], 0.0, atol=1e-10)
    assert np.abs(motion.q[-1][~given] - fleet.starts(mission)[~given]).max() > 0.05, "the others end anywhere"


def test_the_gradient_is_that_of_the_controls():
    problem = build_problem(furnished())
    modes, rng = scaled_modes(problem), np.random.default_rng(1)
    z = random_variables(problem, modes)
    direction, to_u = rng.standard_normal(z.shape), rng.standard_normal(problem.dynamics.controls_shape)
    change = modes.controls(z + direction) - modes.controls(z)  # affine: no small step needed
    assert np.vdot(modes.pull(to_u), direction) == pytest.approx(np.vdot(to_u, change), rel=1e-9)


def test_variables_of_controls_are_found_again():
    problem = build_problem(furnished())
    modes = scaled_modes(problem)
    u = modes.controls(random_variables(problem, modes))
    np.testing.assert_allclose(modes.controls(modes.variables(u)), u, atol=1e-8)


def test_problems_that_give_nothing_keep_their_modes():
    problem = build_problem(imec())
    modes = control_modes(problem.steps, problem.dt, Weights())
    assert problem.ends is None
    assert with_ends(modes, problem) is modes


def test_other_models_of_motion_are_refused():
    problem = build_problem(layered())
    other = dataclasses.replace(
        problem, dynamics=SingleIntegrator(problem.dynamics.start, problem.steps, problem.dt), coarse=None
    )
    with pytest.raises(PlannerError, match="double-integrator dynamics; got SingleIntegrator"):
        scaled_modes(other)


def test_a_start_in_motion_is_where_the_motion_starts():
    velocity = np.array([[0.3, -0.1]])
    moving = DoubleIntegrator(np.array([[1.0, 2.0]]), 20, 0.1, velocity=velocity)
    resting = DoubleIntegrator(moving.start, 20, 0.1)
    u = np.random.default_rng(2).standard_normal(moving.controls_shape)
    t = np.arange(21)[:, None, None] * 0.1
    np.testing.assert_allclose(moving.rollout(u).q, resting.rollout(u).q + t * velocity, atol=1e-12)
    np.testing.assert_allclose(moving.rollout(u).v, resting.rollout(u).v + velocity, atol=1e-12)


@pytest.mark.parametrize(
    ("robot", "constraint", "where"),
    [
        (Robot("r0", (-0.6, -0.6), end=(0.6, -0.5)), "separation", "r0-r1"),
        (Robot("r0", (-0.6, -0.6), end=(0.1, 0.0)), "obstacle clearance", "r0, obstacles[0]"),
        (Robot("r0", (-0.6, -0.6), end=(1.1, 0.0)), "workspace", "r0"),
    ],
)
def test_impossible_ends_are_named(robot, constraint, where):
    other = Robot("r1", (0.6, -0.6), end="start")
    with pytest.raises(UnreachableError, match="the end") as caught:
        check_feasible(small(NoConnectivity(), robots=(robot, other)))
    assert (caught.value.constraint, caught.value.where) == (constraint, where)


def test_ends_out_of_reach_are_named_with_the_bound():
    hurry = small(NoConnectivity(), robots=(Robot("r0", (-0.9, -0.9), end=(0.9, 0.9)),), obstacles=())
    check_feasible(hurry)
    hurry = dataclasses.replace(hurry, horizon=dataclasses.replace(hurry.horizon, duration=3.0))
    with pytest.raises(UnreachableError, match=r"end point \(r0\): at best .* m, required 2\.546 m"):
        check_feasible(hurry)
