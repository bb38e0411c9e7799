"""The reference solver: its LQR, its cost, and the authors' published run, step for step."""

import dataclasses

import numpy as np
import pytest

from missions.schema import Limits, ProbabilisticConnectivity, SolverSettings
from planner.dynamics import DoubleIntegrator, Linearisation
from planner.problem import Margins, build_problem
from planner.solver.imec import algorithm
from planner.solver.imec.cost import Cost
from planner.solver.imec.parameters import Parameters
from planner.solver.imec.riccati import minimiser, solve_riccati
from planner.solver.imec.solve import solve
from planner.solver.result import SolveStatus
from tests.planner.problems import imec, notebook, small

NO_MARGINS = Margins(**{field.name: 0.0 for field in dataclasses.fields(Margins)})
SETTINGS = SolverSettings(method="imec", time_limit=300.0)

# The notebook's printed log: iteration, augmented Lagrangian, sum of scaled violations.
PUBLISHED = (
    (0, -1.67099, 1.15453),
    (1, -1.78593, 1.10197),
    (2, -1.87252, 1.05772),
    (3, -2.00023, 1.06283),
    (10, -2.28729, 1.33385),
    (20, -2.42507, 1.55162),
)


def as_published():
    """The notebook case with the start of the authors' code: everybody moves at 2 m in 30 s along y, no speed limit."""
    starts = notebook()["problem"]["initial_state_per_robot_x_y_vx_vy"]
    robots = tuple(
        dataclasses.replace(robot, velocity=tuple(state[2:]))
        for robot, state in zip(imec().robots, starts, strict=True)
    )
    return build_problem(imec(robots=robots, limits=Limits(0.5, 10.0, 0.3)), NO_MARGINS)


def test_the_authors_run_is_reproduced_to_the_last_printed_digit():
    cost = Cost.of(as_published(), Parameters())
    state = algorithm.init(cost, np.zeros(cost.problem.dynamics.controls_shape))
    for iteration, lagrangian, violation in PUBLISHED:
        while state.iteration <= iteration:
            state = algorithm.step(cost, state)
        assert pytest.approx(lagrangian, abs=2e-5) == state.J, f"iteration {iteration}"
        assert state.violation == pytest.approx(violation, abs=2e-5), f"iteration {iteration}"


def test_the_sub_problem_is_solved():
    """Against the discrete problem written out as one linear system, which it approaches with the step."""
    rng, T, dt = np.random.default_rng(0), 60, 0.02
    Q, R = np.diag([2.0, 0.5]), np.array([[0.3]])
    A, B = np.array([[0.0, 1.0], [-0.4, -0.1]]), np.array([[0.0], [1.0]])
    smooth = np.sin(np.arange(T) * dt * 3.0)
    alpha, beta = rng.standard_normal(2) * smooth[:, None], 0.3 * np.cos(np.arange(T) * dt)[:, None]
    gains = solve_riccati(Linearisation(A[None, None], B[None, None]), T, dt, Q, R)
    du = minimiser(gains, alpha[:, None], beta[:, None])[:, 0, 0]
    step = np.eye(2) + dt * A + 0.5 * dt**2 * A @ A
    push = dt * (np.eye(2) + 0.5 * dt * A) @ B
    Gamma = np.zeros((T, 2, T))
    for t in range(1, T):
        Gamma[t] = step @ Gamma[t - 1]
        Gamma[t, :, t - 1 : t] += push
    H = R[0, 0] * np.eye(T) + np.einsum("txk,xy,tyl->kl", Gamma, Q, Gamma)
    exact = np.linalg.solve(H, -(beta[:, 0] + np.einsum("txk,tx->k", Gamma, alpha)))
    assert np.abs(du - exact).max() <= 0.05 * np.abs(exact).max()


def test_directions_descend():
    problem = build_problem(small(ProbabilisticConnectivity(range=0.5, sub_periods=2, threshold=0.25)))
    cost = Cost.of(problem, Parameters())
    rng = np.random.default_rng(3)
    state = algorithm.init(cost, 0.2 * rng.standard_normal(problem.dynamics.controls_shape))
    gradient = cost.gradient(state.motion, state.multipliers, state.r)
    direction = minimiser(algorithm.gains_of(cost, state.motion), *gradient)
    ahead = cost.value(cost.rollout(state.u + 1e-4 * direction), state.multipliers, state.r)
    assert ahead < cost.value(state.motion, state.multipliers, state.r)


def test_the_gradient_is_that_of_the_cost():
    problem = build_problem(small(ProbabilisticConnectivity(range=0.5, sub_periods=2, threshold=0.25)))
    cost, rng = Cost.of(problem, Parameters(r_b=10.0)), np.random.default_rng(4)
    u = np.clip(0.45 * rng.standard_normal(problem.dynamics.controls_shape), -0.4, 0.4)
    motion = cost.rollout(u)
    multipliers = tuple(rng.random(c.shape) for c in cost.residuals(motion))
    alpha, beta = cost.gradient(motion, multipliers, 5.0)
    du, h = rng.standard_normal(u.shape), 1e-6
    ahead, behind = cost.rollout(u + h * du), cost.rollout(u - h * du)
    numeric = (cost.value(ahead, multipliers, 5.0) - cost.value(behind, multipliers, 5.0)) / (2.0 * h)
    dx = np.concatenate([ahead.q - behind.q, ahead.v - behind.v], axis=-1)[:-1] / (2.0 * h)
    assert np.vdot(alpha, dx) + np.vdot(beta, du) == pytest.approx(numeric, rel=1e-5)


@pytest.fixture(scope="module")
def outcome():
    problem = build_problem(small(robots=small().robots[:1]))
    return problem, solve(problem, SETTINGS, parameters=Parameters(iterations=60))


def test_a_plan_meets_every_limit(outcome):
    problem, done = outcome
    assert done.status.feasible
    motion = problem.dynamics.rollout(done.plan.u)
    np.testing.assert_allclose(motion.q, done.plan.q, atol=1e-12)
    for constraint in problem.constraints:
        assert float(constraint.violation(motion).max()) <= constraint.tolerance, constraint.name
    assert done.plan.ergodicity == problem.metric.value(done.plan.q[:-1])


def test_seeds_begin_beside_each_other():
    problem = build_problem(small())
    few = Parameters(iterations=2)
    runs = [solve(problem, dataclasses.replace(SETTINGS, seed=seed), parameters=few).history for seed in (0, 0, 1)]
    assert runs[0][-1].E == runs[1][-1].E
    assert runs[0][-1].E != runs[2][-1].E
    assert pytest.approx(runs[2][-1].E, rel=0.1) == runs[0][-1].E


def test_interruption_before_anything_is_feasible():
    done = solve(build_problem(imec()), SETTINGS, should_stop=lambda: True)
    assert (done.plan, done.status) == (None, SolveStatus.INTERRUPTED)
    assert done.violations


def test_controls_never_exceed_their_bounds():
    problem = build_problem(small())
    cost = Cost.of(problem, Parameters())
    wild = 100.0 * np.random.default_rng(5).standard_normal(problem.dynamics.controls_shape)
    assert isinstance(problem.dynamics, DoubleIntegrator)
    assert np.abs(cost.rollout(wild).u).max() == pytest.approx(0.5 * (1.0 - Margins().acceleration))
