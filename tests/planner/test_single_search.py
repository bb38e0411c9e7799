"""One robot with a model of its own: against the authors' numbers, gradients, ends, walls, changed maps."""

import json
from dataclasses import replace
from pathlib import Path

import casadi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.dynamics.casadi_model import build_model
from planner.errors import PlannerError
from planner.single import DifferentialDrive, LossWeights, search
from planner.single.expressions import ExpressionModel
from planner.single.search import HARD_END
from tests.planner import drive_example as example

GOLDEN = Path(__file__).parents[1] / "golden" / "ergodic_search.json"


@pytest.fixture(scope="module")
def published():
    return json.loads(GOLDEN.read_text())


@pytest.fixture(scope="module")
def found():
    return search(example.task(), enough=3.4e-3)


def expressions(steps: int) -> ExpressionModel:
    """A unicycle with a speed that changes: states x, y, θ, v; controls turn and acceleration."""
    x, u = casadi.SX.sym("x", 4), casadi.SX.sym("u", 2)
    derivative = casadi.vertcat(x[3] * casadi.cos(x[2]), x[3] * casadi.sin(x[2]), u[0], u[1])
    model = build_model(x, u, derivative, x[:2], 0.1)
    return ExpressionModel(model, np.array([0.2, 0.3, 0.1, 0.2]), steps, np.array([0.5, 0.3]), np.array([0.1, 0.0]))


def test_the_authors_coefficients_and_loss(published):
    task = example.task()
    assert np.abs(task.metric.phi_k.ravel() - published["phi_k"]).max() < 1e-12
    loss, theirs = task.loss(np.array(published["controls"])), published["loss"]
    assert loss.ergodic == pytest.approx(theirs["ergodic"], abs=1e-7)
    assert loss.effort == pytest.approx(0.1 * theirs["transl"] + 0.05 * theirs["ang"], abs=1e-7)
    assert loss.end == pytest.approx(0.5 * theirs["end"], abs=1e-7)
    assert loss.boundary == 0.0
    assert loss.total == pytest.approx(theirs["total"], abs=1e-7)


def test_a_lower_loss_than_the_authors_in_a_fraction_of_the_steps(found):
    assert found.loss.total <= 3.5e-3  # theirs: 0.003552 after 1000 steps
    assert found.evaluations <= 400
    assert found.loss.boundary == 0.0


@pytest.mark.parametrize("model", [DifferentialDrive((0.2, 0.3, 0.4), 15), expressions(15)], ids=["drive", "casadi"])
@given(seed=st.integers(0, 10_000))
@settings(max_examples=10, deadline=None)
def test_gradients_of_every_term(model, seed):
    """Far from the walls and beyond them, with a soft end and a hard one."""
    rng = np.random.default_rng(seed)
    n = model.states(np.zeros((15, 2))).shape[1]
    end = (0.9, 0.1, *(np.nan,) * (n - 2))
    u = model.scale * rng.normal(1.0, 3.0, (15, 2))
    for weights in (LossWeights(), LossWeights(end=None, effort=(0.3, 0.7))):
        task = replace(example.task(), model=model, weights=weights, end=end)
        extra = {"wall": 7.0, "multipliers": rng.normal(size=n), "penalty": 3.0}
        du, h = model.scale * rng.normal(size=u.shape), 1e-6
        gradient = task.evaluate(u, **extra)[1]
        ahead, behind = (task.evaluate(u + sign * h * du, **extra)[0] for sign in (1, -1))
        numeric = (ahead - behind) / (2 * h)
        size = np.linalg.norm(gradient * model.scale) * np.linalg.norm(du / model.scale)
        assert np.vdot(gradient, du) == pytest.approx(numeric, abs=1e-5 * size + 1e-7)


def test_inside_the_box_the_stand_in_is_the_loss(found):
    task = example.task()
    assert task.evaluate(found.u, wall=1.0)[0] == pytest.approx(found.loss.total, rel=1e-12)


def test_a_hard_end_is_met():
    task = example.task(weights=LossWeights(end=None))
    hard = search(task, iterations=60)
    assert hard.miss <= HARD_END
    assert hard.loss.end == 0.0
    assert np.abs(hard.states[-1] - example.END).max() <= HARD_END


def test_walls_hold_where_the_information_is_beyond_them():
    """Coefficients of a map that is all at a corner draw the robot out; what it gains there is less than it pays."""
    corner = example.BASIS.functions(np.array([[1.0, 1.0]]))[0]
    found = search(example.task(corner), iterations=150)
    assert found.loss.boundary <= 1e-6
    assert (found.states[:, :2] <= 1.0 + 1e-8).all()


def test_a_changed_map_is_searched_from_what_there_is(found):
    """What was driven stays as it is, and the loss of the new map falls to what it was on the old one."""
    task = example.task(example.transform(example.density(example.MEANS + np.array([[0.02, -0.01], [-0.02, 0.01]]))))
    again = search(task, initial=found.u, first=20, enough=5e-3)
    assert np.array_equal(again.u[:20], found.u[:20])
    assert again.loss.total <= 5e-3 < task.loss(found.u).total
    assert again.evaluations < found.evaluations


def test_no_time_no_search(found):
    late = search(example.task(), initial=found.u, time_limit=0.0)
    assert late.loss.total <= found.loss.total + 1e-12
    assert late.evaluations == 1


def test_any_casadi_model_covers_the_map():
    task = replace(example.task(), model=expressions(100), weights=LossWeights(effort=(1e-4, 1e-4), end=None), end=None)
    begin = task.loss(task.guess()).total
    assert search(task, iterations=150).loss.total < 0.1 * begin


def test_what_does_not_fit_is_refused(found):
    with pytest.raises(PlannerError, match="got 1 effort weights; allowed: 2"):
        example.task(weights=LossWeights(effort=(1.0,)))
    with pytest.raises(PlannerError, match="got an end of 2 numbers; allowed: 3"):
        replace(example.task(), end=(0.1, 0.2))
    with pytest.raises(PlannerError, match=r"got controls of shape \(5, 2\)"):
        search(example.task(), initial=np.zeros((5, 2)))
    with pytest.raises(PlannerError, match="100 of them kept"):
        search(example.task(), initial=found.u, first=100)


def test_found_plans_are_read_only(found):
    with pytest.raises(ValueError, match="read-only"):
        found.u[0, 0] = 1.0
