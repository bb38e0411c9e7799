import numpy as np
import pytest

from planner.dynamics import Cotangent, DoubleIntegrator, Motion
from planner.solver.modes import Weights, control_modes

DT = 0.1


def dynamics(steps=30, substeps=2):
    return DoubleIntegrator(np.array([[0.5, 0.3, 1.0], [1.2, 0.3, 0.8]]), steps, DT, substeps)


def test_rollout_is_the_step_by_step_recursion():
    model = dynamics()
    u = np.random.default_rng(0).standard_normal(model.controls_shape)
    motion = model.rollout(u)
    q, v = model.start.copy(), np.zeros_like(model.start)
    for t in range(model.steps):
        np.testing.assert_allclose(motion.q[t], q, atol=1e-12)
        np.testing.assert_allclose(motion.v[t], v, atol=1e-12)
        q = q + v * DT + 0.5 * u[t] * DT**2
        v = v + u[t] * DT
    np.testing.assert_allclose(motion.q[-1], q, atol=1e-12)


@pytest.mark.parametrize("substeps", [1, 2, 4])
def test_fine_samples_lie_on_the_same_motion(substeps):
    coarse = dynamics(substeps=substeps)
    u = np.random.default_rng(1).standard_normal(coarse.controls_shape)
    fine = DoubleIntegrator(coarse.start, coarse.steps * substeps, DT / substeps)
    np.testing.assert_allclose(coarse.rollout(u).q_fine, fine.rollout(np.repeat(u, substeps, axis=0)).q, atol=1e-12)


@pytest.mark.parametrize("substeps", [1, 2, 3])
def test_pull_is_the_transpose_of_the_rollout(substeps):
    model, rng = dynamics(substeps=substeps), np.random.default_rng(2)
    u, du = rng.standard_normal((2, *model.controls_shape))
    motion, moved = model.rollout(u), model.rollout(u + du)
    cotangent = Cotangent(*(rng.standard_normal(part.shape) for part in motion))
    before = Cotangent(*(part.copy() for part in cotangent))
    change = Motion(*(b - a for a, b in zip(motion, moved, strict=True)))
    forward = sum(np.vdot(c, d) for c, d in zip(cotangent, change, strict=True))
    assert np.vdot(model.pull(motion, cotangent), du) == pytest.approx(forward, rel=1e-10)
    for part, kept in zip(cotangent, before, strict=True):
        np.testing.assert_array_equal(part, kept)


@pytest.mark.parametrize("steps", [7, 80, 300])
def test_every_combination_of_control_modes_ends_at_rest(steps):
    modes = control_modes(steps, DT, Weights())
    z = np.random.default_rng(3).standard_normal((modes.S.shape[1], 2, 3))
    motion = dynamics(steps).rollout(modes.controls(z))
    assert np.abs(motion.v[-1]).max() < 1e-12 * max(1.0, np.abs(motion.v).max()) * steps
    assert np.abs(motion.v).max() > 0.01


def test_variables_of_controls_are_found_again():
    modes = control_modes(50, DT, Weights())
    z = np.random.default_rng(4).standard_normal((modes.S.shape[1], 2, 2))
    np.testing.assert_allclose(modes.variables(modes.controls(z)), z, atol=1e-8)


def test_scaled_variables_have_a_unit_hessian_in_the_quadratic_model():
    weights = Weights(J=0.0, Qq=0.0, Qv=0.0)
    S = control_modes(40, DT, weights).S
    np.testing.assert_allclose(weights.R * S.T @ S, np.eye(S.shape[1]), atol=1e-10)
