"""Many weights at once: derivatives, independence of lanes, and the published cases."""

import dataclasses

import numpy as np
import pytest

from planner.pareto import simplex
from planner.pareto.drive import DriveProblem
from planner.pareto.exchange import best_for, search_all
from planner.pareto.hypervolume import hypervolume
from planner.pareto.ideal import ideal_vectors
from planner.pareto.minimise import minimise
from planner.pareto.sequence import search_in_order
from tests.planner.moes import GOLDEN, published


@pytest.fixture(scope="module")
def two():
    return published(2)


def controls(problem, lanes, seed=0):
    z = np.random.default_rng(seed).normal(scale=0.05, size=(lanes, 2 * problem.steps))
    z[:, : problem.steps] += 0.04  # away from |v| = 0, where there is no derivative
    return z


def test_coefficients_are_those_the_authors_computed():
    stored = np.load(GOLDEN)["phik_as_coded"]
    problem, textbook = published(3), published(3, coded=False)
    k = np.arange(10)
    norm = np.where(k > 0, np.sqrt((2 * k + np.sin(2 * k)) / (4 * np.maximum(k, 1))), 1.0)
    assert problem.phi / np.outer(norm, norm) == pytest.approx(stored, abs=2e-6)  # theirs are single precision
    distances = [problem.distances[pair] for pair in ((0, 1), (0, 2), (1, 2))]
    assert distances == pytest.approx([0.895, 0.430, 0.875], abs=5e-4)
    assert (textbook.distances[0, 1] > problem.distances[0, 1]).all()


def test_gradient(two):
    z, direction = controls(two, 3), controls(two, 3, seed=1)
    phi = np.broadcast_to(two.phi[0], (3, 10, 10))
    _, gradient = two.evaluate(z, phi)
    h = 1e-6
    slope = (two.evaluate(z + h * direction, phi)[0] - two.evaluate(z - h * direction, phi)[0]) / (2 * h)
    assert (gradient * direction).sum(axis=1) == pytest.approx(slope, rel=1e-6, abs=1e-9)


def test_the_robot_moves_before_it_turns_and_only_forwards():
    problem = DriveProblem(np.ones((2, 4, 4)), np.ones((4, 4)), start=(0.5, 0.5, 0.0), steps=3)
    motion = problem.roll(np.array([[-0.1, 0.2, 9.0, np.pi / 20.0, 0.0, 9.0]]))
    assert motion.q[:, 0] == pytest.approx(np.array([[0.5, 0.6, 0.6], [0.5, 0.5, 0.7]]))


def test_vectors_are_the_objectives_of_each_map(two):
    z = controls(two, 4)
    for number, phi in enumerate(two.phi):
        alone, _ = two.evaluate(z, np.broadcast_to(phi, (4, 10, 10)))
        assert two.vectors(z)[:, number] == pytest.approx(alone)


def test_lanes_do_not_know_of_each_other(two):
    z, phi = controls(two, 3), np.broadcast_to(two.phi[1], (3, 10, 10))
    together, values, _ = minimise(lambda x: two.evaluate(x, phi), z, 30)
    for lane in range(3):
        alone, value, _ = minimise(lambda x: two.evaluate(x, phi[:1]), z[lane : lane + 1], 30)
        assert value == pytest.approx(values[lane : lane + 1], rel=1e-6)
        assert alone == pytest.approx(together[lane : lane + 1], abs=1e-4)
    assert (values < two.evaluate(z, phi)[0]).all()


def test_minimising_a_quadratic_finds_its_minimum():
    scale, centre = np.geomspace(1.0, 100.0, 8), np.arange(8.0)

    def bowl(z):
        return 0.5 * (scale * (z - centre) ** 2).sum(axis=1), scale * (z - centre)

    z, value, _ = minimise(bowl, np.zeros((2, 8)), 60)
    assert z == pytest.approx(np.tile(centre, (2, 1)), abs=1e-6)
    assert value == pytest.approx(0.0, abs=1e-10)


def test_what_is_good_enough_is_not_improved(two):
    z, phi = controls(two, 2), two.phi
    found = minimise(lambda x: two.evaluate(x, phi), z, 500, enough=0.05)
    assert found.iterations < 100
    assert found.value.max() <= 0.05
    before = minimise(lambda x: two.evaluate(x, phi), z, found.iterations - 1)
    assert before.value.max() > 0.05


def test_warm_starts_take_fewer_iterations_than_scratch(two):
    """The claim of SLES (Fig. 5), for a front as good."""
    episodes = simplex.breadth_first(simplex.grid(2, 0.1), np.array([0.5, 0.5]))
    warm = search_in_order(two, episodes)
    scratch = search_in_order(two, [dataclasses.replace(episode, parent=None) for episode in episodes])
    assert warm.iterations.sum() < 0.7 * scratch.iterations.sum()
    assert hypervolume(warm.vectors) == pytest.approx(hypervolume(scratch.vectors), abs=0.003)


def test_everybody_takes_the_best_there_is_for_him():
    vectors = np.array([[0.0, 1.0], [0.3, 0.3], [0.9, 0.05]])
    assert best_for(vectors, np.array([[1.0, 0.0], [0.5, 0.5], [0.1, 0.9]])).tolist() == [0, 1, 2]


def test_two_maps_as_published_with_as_many_points(two):
    weights = np.array([e.weights for e in simplex.breadth_first(simplex.grid(2, 0.1), np.array([1.0, 0.0]))])
    front = search_all(two, weights)
    assert len(front.vectors) == 11
    assert hypervolume(front.vectors) >= 0.8676
    ideal = ideal_vectors(weights, two.distances)
    assert (front.vectors @ weights.T >= np.einsum("nm,nm->n", weights, ideal)).all()
    again = search_all(two, weights)
    assert np.array_equal(front.controls, again.controls)
