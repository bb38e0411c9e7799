"""One finite-difference test over the metric and every constraint."""

import numpy as np
import pytest

from planner.connectivity.quadrature import every_step
from planner.dynamics import Cotangent, Motion
from planner.indicators import ergodic_metric
from planner.problem import build_problem
from planner.solver.lagrangian import Lagrangian
from planner.solver.modes import Weights, control_modes
from planner.solver.scaling import scaled_modes
from tests.planner.policy_missions import POLICIES, with_policy
from tests.planner.problems import box, furnished, imec, layered, small

STEP = 1e-6  # central differences of functions of order 1: truncation 1e-12, rounding 1e-10
TOLERANCE = 1e-6  # relative to the gradient's size
FAR = -0.1  # residual below which distances are capped and pull nobody


def random_motion(problem, seed=0):
    """A motion under random controls."""
    rng = np.random.default_rng(seed)
    T, robots, nu = problem.dynamics.controls_shape
    modes = control_modes(T, problem.dt, Weights())
    return problem.dynamics.rollout(modes.controls(0.4 * rng.standard_normal((modes.S.shape[1], robots, nu))))


def fold(x, lower, upper):
    """Reflected at the walls until inside."""
    return lower + np.abs((x - lower + (upper - lower)) % (2.0 * (upper - lower)) - (upper - lower))


def motion_near(problem, constraint):
    """A random motion that a constraint has something to say about: folded into the workspace if need be."""
    box = next(c for c in problem.constraints if c.name == "workspace")
    for seed in range(100):
        motion = random_motion(problem, seed)
        drift = 0.01 * np.arange(len(motion.q_fine))[:, None, None]  # at rest, closest approaches leap at a touch
        motion = motion._replace(q_fine=motion.q_fine + drift)
        for found in (motion, motion._replace(q_fine=fold(motion.q_fine, box.lower, box.upper))):
            if constraint.evaluate(found).residual.max() > FAR:
                return found
    raise AssertionError(f"no motion comes near {constraint.name}")


def moved(motion, direction, step):
    return Motion(*(part + step * change for part, change in zip(motion, direction, strict=True)))


def check_pull(constraint, motion, seed=0):
    rng = np.random.default_rng(seed)
    g, pull = constraint.evaluate(motion)
    weights = rng.standard_normal(g.shape)
    weights[g < FAR] = 0.0
    cotangent = Cotangent.zeros_like(motion)
    pull(weights, cotangent)
    for part in range(len(motion)):
        direction = [rng.standard_normal(p.shape) if i == part else np.zeros_like(p) for i, p in enumerate(motion)]
        ahead, behind = (constraint.evaluate(moved(motion, direction, s)).residual for s in (STEP, -STEP))
        numeric = np.vdot(weights, ahead - behind) / (2.0 * STEP)
        analytic = np.vdot(cotangent[part], direction[part])
        size = np.linalg.norm(cotangent[part]) * np.linalg.norm(direction[part]) + 1e-12
        assert abs(numeric - analytic) <= TOLERANCE * size, f"{constraint.name}, d/d{Motion._fields[part]}"


POLICY_CONSTRAINTS = {"connection", "same-time connection", "meeting", "rendezvous", "contact at all times", "contact"}
PROBLEMS = [build_problem(mission) for mission in (imec(), box(), furnished(), layered())]
POLICY_PROBLEMS = [build_problem(with_policy(name)) for name in POLICIES]
CONSTRAINTS = [
    *((p, c) for p in PROBLEMS for c in (*p.constraints, *p.preferences)),
    *((p, c) for p in POLICY_PROBLEMS for c in (*p.constraints, *p.preferences) if c.name in POLICY_CONSTRAINTS),
]


def test_the_problems_have_every_constraint():
    assert {c.name for _, c in CONSTRAINTS} == {
        "separation", "landing separation", "obstacle clearance", "landing obstacles", "keep-out zone", "keep-in zone",
        "workspace", "speed", "acceleration", *POLICY_CONSTRAINTS,
    }  # fmt: skip


@pytest.mark.parametrize(("problem", "constraint"), CONSTRAINTS, ids=[c.name for _, c in CONSTRAINTS])
def test_constraint(problem, constraint):
    check_pull(constraint, motion_near(problem, constraint))


@pytest.mark.parametrize(("problem", "constraint"), CONSTRAINTS, ids=[c.name for _, c in CONSTRAINTS])
def test_residual_and_exact_violation_agree_on_what_is_met(problem, constraint):
    motion = motion_near(problem, constraint)
    constraint = getattr(constraint, "inner", constraint)  # of trees: see their own test
    residual, violation = constraint.evaluate(motion).residual, constraint.violation(motion)
    if constraint.name in ("meeting", "contact"):  # deliberately pessimistic: met says met, missed says nothing
        assert (violation[residual <= 0.0] <= 1e-12).all()
        return
    clear = np.abs(violation) > 1e-3  # thinned averages decide no closer than that
    np.testing.assert_array_equal((residual > 0.0)[clear], (violation > 0.0)[clear])


@pytest.mark.parametrize("seed", range(5))
def test_a_met_meeting_residual_proves_a_meeting(seed):
    problem = PROBLEMS[0]
    (meeting,) = problem.preferences
    motion = random_motion(problem, seed)
    residual, violation = meeting.evaluate(motion).residual, meeting.violation(motion)
    reach = meeting.range[:, None]
    distance = violation + reach
    assert (residual >= (distance**2 - reach**2) / (2.0 * reach) - 1e-12).all()


@pytest.mark.parametrize("mission", [imec(), box()], ids=["2-D", "3-D"])
def test_metric(mission):
    metric = ergodic_metric(mission)
    rng = np.random.default_rng(1)
    basis = metric.basis
    q = rng.uniform(basis.lower, basis.upper, (20, 3, len(basis.lower)))
    value, gradient = metric.evaluate(q)
    assert value == pytest.approx(metric.value(q), rel=1e-12)
    direction = rng.standard_normal(q.shape)
    numeric = (metric.value(q + STEP * direction) - metric.value(q - STEP * direction)) / (2.0 * STEP)
    size = np.linalg.norm(gradient) * np.linalg.norm(direction)
    assert abs(numeric - np.vdot(gradient, direction)) <= TOLERANCE * size


@pytest.mark.parametrize("mission", [imec(), box(), small(), furnished(), layered()], ids=lambda m: m.name)
def test_augmented_lagrangian(mission):
    problem = build_problem(mission)
    modes = scaled_modes(problem)
    lagrangian = Lagrangian(problem, modes, (*problem.constraints, *problem.preferences))
    rng = np.random.default_rng(2)
    _, robots, nu = problem.dynamics.controls_shape
    z = 0.4 * rng.standard_normal(modes.S.shape[1] * robots * nu)
    multipliers = [
        np.maximum(rng.standard_normal(c.evaluate(lagrangian.motion(z)).residual.shape), 0.0)
        for c in lagrangian.constraints
    ]
    _, gradient = lagrangian(z, multipliers, 3.0)
    direction = rng.standard_normal(z.shape)
    ahead, behind = (lagrangian(z + s * direction, multipliers, 3.0)[0] for s in (STEP, -STEP))
    size = np.linalg.norm(gradient) * np.linalg.norm(direction)
    assert abs((ahead - behind) / (2.0 * STEP) - gradient @ direction) <= 1e-5 * size


def test_every_step_is_the_plain_mean():
    quadrature = every_step([(0, 4), (4, 7)])
    f = np.arange(7.0) ** 2
    np.testing.assert_allclose((quadrature.weights * f[quadrature.nodes]).sum(axis=1), [3.5, (16 + 25 + 36) / 3])
