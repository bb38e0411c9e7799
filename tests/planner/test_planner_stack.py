"""Swarms that share an evaluation get what each would get alone."""

from __future__ import annotations

import numpy as np
import pytest

from planner.problem import build_problem
from planner.solver import augmented_lagrangian as al
from planner.solver.lanes import Closed, Runner, run_lanes
from planner.solver.lbfgs import Memory
from planner.solver.search import Search
from planner.solver.stack import Stack, stackable
from tests.planner.problems import imec, scaling

SWARMS = 3


@pytest.fixture(scope="module", params=[imec, lambda: scaling(5, sub_periods=2)], ids=["obstacles", "far apart"])
def problem(request):
    problem = build_problem(request.param())
    return problem.coarse or problem


@pytest.fixture
def states(problem):
    lagrangian, rng = Search.formulate(problem), np.random.default_rng(4)
    size = lagrangian.modes.S.shape[1] * problem.dynamics.start.size
    return lagrangian, [al.init(lagrangian, 0.1 * rng.standard_normal(size), al.Schedule()) for _ in range(SWARMS)]


def test_values_and_gradients_are_those_of_each_swarm_alone(problem, states):
    lagrangian, alone = states
    assert stackable(problem)
    stack = Stack(problem, SWARMS)
    for number, state in enumerate(alone):
        stack.load(number, state.multipliers, 0.1 * (1 + number))
    value = stack.evaluate(np.stack([state.z for state in alone]), np.zeros(SWARMS, dtype=bool), 1.0, 1.0)
    for number, state in enumerate(alone):
        L, gradient = lagrangian(state.z, state.multipliers, 0.1 * (1 + number))
        assert value.L[number] == pytest.approx(L, rel=1e-4)
        assert value.E[number] == pytest.approx(state.E, rel=1e-4)
        assert np.linalg.norm(value.gradient[number] - gradient) <= 1e-3 * np.linalg.norm(gradient)


def test_rounds_in_lanes_are_those_of_each_search_alone(problem, states):
    lagrangian, alone = states
    schedule = al.Schedule(iterations=2)
    stack = Stack(problem, 2)  # fewer lanes than searches
    ran, evaluations = run_lanes(stack, [Runner(state, Memory()) for state in alone], 2, schedule, lambda: True)
    assert evaluations >= SWARMS * 2 * 3
    for start, runner in zip(alone, ran, strict=True):
        memory, state = Memory(), start
        for _ in range(2):
            state = al.step(lagrangian, state, schedule.steady, memory, lambda: True)
        assert runner.state.round == 2
        assert runner.state.mu == pytest.approx(state.mu)
        assert pytest.approx(state.E, rel=0.02) == runner.state.E
        for mine, theirs in zip(runner.state.multipliers, state.multipliers, strict=True):
            assert np.linalg.norm(mine - theirs) <= 0.02 * np.linalg.norm(theirs) + 1e-6


def test_lanes_tell_where_they_stand_whenever_one_closes_a_round(problem, states):
    _, alone = states
    told: list[Closed] = []
    field = [Runner(state, Memory()) for state in alone]
    _, evaluations = run_lanes(Stack(problem, 2), field, 2, al.Schedule(iterations=2), lambda: True, told.append)
    assert len(told) > SWARMS  # some lanes close theirs together
    counts = [entry.evaluations for entry in told]
    assert counts == sorted(counts)
    assert counts[-1] == evaluations
    assert all(np.isfinite(entry.worst) and entry.E > 0.0 for entry in told)


def test_lanes_stop_when_told(problem, states):
    _, alone = states
    assert run_lanes(Stack(problem, 2), [Runner(s, Memory()) for s in alone], 2, al.Schedule(), lambda: False) == (
        [],
        0,
    )
