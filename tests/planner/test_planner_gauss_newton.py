"""The Gauss-Newton matrix is what differences say, and pays."""

import copy
import dataclasses

import numpy as np
import pytest

from planner.constraints.base import Curved
from planner.constraints.paths import push
from planner.dynamics import Cotangent
from planner.ergodic.metric import SquaresMetric
from planner.indicators import ergodic_metric
from planner.problem import build_problem
from planner.solver import augmented_lagrangian as al
from planner.solver import gauss_newton
from planner.solver.gauss_newton import Factor, GaussNewton
from planner.solver.lagrangian import SMALLEST_E
from planner.solver.lbfgs import Memory
from planner.solver.search import Search
from tests.planner.problems import box, furnished, imec, scaling, small
from tests.planner.test_planner_derivatives import FAR, motion_near, random_motion

PROBLEMS = [build_problem(mission) for mission in (imec(), box(), furnished())]
CURVED = [(p, c) for p in PROBLEMS for c in p.constraints if isinstance(c, Curved)]
MU = 3.0


def formulated(mission, seed=0):
    """A formulation, variables near which limits are in force, and multipliers."""
    lagrangian = Search.formulate(dataclasses.replace(build_problem(mission), coarse=None))
    rng = np.random.default_rng(seed)
    _, robots, nu = lagrangian.problem.dynamics.controls_shape
    z = 0.4 * rng.standard_normal(lagrangian.modes.count * robots * nu)
    return lagrangian, z, tuple(rng.random(g.shape) for g in lagrangian.at(z).residuals)


class TestRows:
    @pytest.mark.parametrize(("problem", "constraint"), CURVED, ids=lambda item: getattr(item, "name", ""))
    def test_rows_are_what_is_pulled(self, problem, constraint):
        motion = motion_near(problem, constraint)
        g, pull = constraint.evaluate(motion)
        weights = np.where(g > FAR, np.random.default_rng(0).random(g.shape), 0.0)
        pulled, summed = Cotangent.zeros_like(motion), Cotangent.zeros_like(motion)
        pull(weights, pulled)
        rows, acting = constraint.rows(motion, weights), weights[weights > 0.0]
        part = getattr(summed, rows.part)
        for robot, force in zip(rows.robots, rows.forces, strict=True):
            push(part[..., : len(force)], rows.samples, rows.shares, robot, force * acting)
        for mine, theirs in zip(summed, pulled, strict=True):
            np.testing.assert_allclose(mine, theirs, atol=1e-12)

    @pytest.mark.parametrize("mission", [imec(), box()], ids=["plane", "space"])
    def test_squares_are_those_of_the_metric(self, mission):
        metric, q = ergodic_metric(mission), random_motion(build_problem(mission)).q[:-1]
        assert isinstance(metric, SquaresMetric)
        everything = metric.basis.Lambda_k.size
        rows = metric.squares(q, everything).transpose(0, 3, 1, 2)  # (k, T, N, ν)
        order = np.argsort(-metric.basis.Lambda_k, axis=None, kind="stable")[1:]
        error = (np.sqrt(metric.basis.Lambda_k) * (metric.statistics(q) - metric.phi_k)).ravel()[order]
        np.testing.assert_allclose(
            2.0 * np.tensordot(error, rows, axes=1), metric.evaluate(q).gradient, atol=1e-5 * np.abs(rows).max()
        )
        assert len(metric.squares(q, 7)) == 7


class TestMatrix:
    def test_it_is_the_sum_of_squares_of_changes(self):
        """Of a step: what the squares of E and of active limits change by, to first order."""
        lagrangian, z, multipliers = formulated(small(robots=small().robots[:1]))
        model, sample = GaussNewton.of(lagrangian), lagrangian.at(z)
        known = [number for number, c in enumerate(lagrangian.constraints) if isinstance(c, Curved)]
        active = [multipliers[number] + MU * sample.residuals[number] > 0.0 for number in known]
        problem, metric = lagrangian.problem, lagrangian.problem.metric

        def squares(at):
            """Everything that is squared, at variables."""
            motion = lagrangian.motion(at)
            c_k = metric.statistics(motion.q[:-1]) * np.sqrt(metric.basis.Lambda_k)
            parts = [c_k.ravel() * np.sqrt(2.0 / ((sample.E + SMALLEST_E) * np.log(10.0)))]
            parts += [motion.u.ravel() * np.sqrt(problem.control_weight / problem.steps)]
            for number, mine in zip(known, active, strict=True):
                parts.append(np.sqrt(MU) * lagrangian.constraints[number].evaluate(motion).residual[mine])
            return np.concatenate(parts)

        H = model.matrix(sample, multipliers, MU)
        step = np.random.default_rng(1).standard_normal(len(z))
        change = (squares(z + 1e-6 * step) - squares(z - 1e-6 * step)) / 2e-6
        blocked = step.reshape(model.modes, -1).T.ravel()
        assert blocked @ H @ blocked == pytest.approx(change @ change, rel=1e-3)

    def test_a_factor_by_blocks_solves(self):
        rng = np.random.default_rng(0)
        A = rng.standard_normal((24, 30))
        H, x = (A @ A.T).astype(np.float32), rng.standard_normal(24).astype(np.float32)
        np.testing.assert_allclose(Factor.of(H.copy(), 8).solve(x), np.linalg.solve(H, x), rtol=1e-3)

    def test_what_is_not_positive_definite_is_refused(self):
        with pytest.raises(np.linalg.LinAlgError):
            Factor.of(-np.eye(8, dtype=np.float32), 4)


class TestUse:
    def test_nothing_is_said_before_a_scale_is_known(self):
        lagrangian, z, multipliers = formulated(small())
        model = GaussNewton.of(lagrangian)
        assert model.inverse(lagrangian.at(z), multipliers, MU, Memory()) is None
        assert GaussNewton.of(lagrangian, 1.0).inverse(lagrangian.at(z), multipliers, MU, Memory()) is not None

    def test_it_pays(self):
        """As many evaluations go farther with it, once a search has begun."""
        lagrangian, z, _ = formulated(small())
        schedule = al.Schedule().steady
        begun, memory = al.init(lagrangian, z, schedule), Memory()
        for _ in range(25):
            begun = al.step(lagrangian, begun, schedule, memory, lambda: True)
        ergodicity = {}
        for model in (None, GaussNewton.of(lagrangian)):
            state, mine, before = begun, copy.deepcopy(memory), lagrangian.evaluations
            while lagrangian.evaluations < before + 100:
                state = al.step(lagrangian, state, schedule.informed, mine, lambda: True, model)
            ergodicity[model is not None] = state.E
        assert ergodicity[True] < 0.95 * ergodicity[False]

    def test_it_is_for_problems_it_knows_and_that_are_small_enough(self, monkeypatch):
        lagrangian, _, _ = formulated(small())
        assert GaussNewton.of(lagrangian) is not None
        monkeypatch.setattr(gauss_newton, "LARGEST", 10)
        assert GaussNewton.of(lagrangian) is None

    def test_limits_it_does_not_know_are_counted(self):
        lagrangian, _, multipliers = formulated(scaling(5))
        model = GaussNewton.of(lagrangian)
        assert not model.covers(multipliers)  # ten pairs' probabilities and meetings
        assert model.covers(tuple(0.0 * lam for lam in multipliers))
