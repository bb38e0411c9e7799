"""Where weights are tried: grids, A-SLES's simplex and its degenerate cases, the order of SLES, the ideal front."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.pareto import simplex
from planner.pareto.hypervolume import hypervolume
from planner.pareto.ideal import forecast, gaps, ideal_vectors
from planner.pareto.simplex import DegenerateSimplexError, RegularGrid, WeightSpaceError


def maps(m, seed=0):
    """Coefficients of m maps, and the distances between them."""
    phi = np.random.default_rng(seed).normal(size=(m, 12))
    return phi, np.linalg.norm(phi[:, None] - phi[None], axis=-1)


@pytest.mark.parametrize(("m", "divisions"), [(2, 10), (3, 20), (4, 5)])
def test_sles_covers_the_whole_grid_once(m, divisions):
    episodes = simplex.breadth_first(RegularGrid(m, divisions), np.full(m, 1.0 / m))
    weights = np.array([episode.weights for episode in episodes])
    assert len(episodes) == math.comb(divisions + m - 1, m - 1) == len(np.unique(weights.round(9), axis=0))
    assert weights.min() >= 0.0
    assert weights.sum(axis=1) == pytest.approx(1.0)
    assert episodes[0].parent is None
    for number, episode in enumerate(episodes[1:], 1):
        assert 0 <= episode.parent < number
        moved = np.sort(episode.weights - episodes[episode.parent].weights)
        assert moved == pytest.approx([-1.0 / divisions, *[0.0] * (m - 2), 1.0 / divisions])


@given(st.lists(st.floats(0.001, 1.0), min_size=2, max_size=5), st.integers(1, 30))
def test_the_grid_point_to_begin_with_is_near(raw, divisions):
    weights = np.array(raw) / sum(raw)
    key = RegularGrid(len(raw), divisions).nearest(weights)
    assert sum(key) == divisions
    assert np.abs(np.array(key) / divisions - weights).max() < 1.0 / divisions


def test_early_termination_stays_around_the_preference():
    prefer = np.array([0.6, 0.2, 0.2])
    episodes = simplex.breadth_first(
        RegularGrid(3, 20), prefer, inside=lambda w: bool(np.abs(w - prefer).max() < 0.1001)
    )
    away = [np.abs(episode.weights - prefer).max() for episode in episodes]
    assert max(away) == pytest.approx(0.1)
    assert away[0] == pytest.approx(0.0)
    assert len(episodes) == 19  # a hexagon around it


@pytest.mark.parametrize("m", [2, 3, 4, 5])
def test_edges_of_the_transformed_simplex_are_the_distances_of_the_maps(m):
    _, distances = maps(m)
    corners = simplex.embedded(distances)
    assert np.linalg.norm(corners[:, None] - corners[None], axis=-1) == pytest.approx(distances)


@pytest.mark.parametrize("m", [2, 3, 4])
def test_the_affine_map_takes_corners_to_corners(m):
    corners = simplex.embedded(maps(m)[1])
    for corner, pure in zip(corners, np.eye(m), strict=True):
        assert simplex.barycentric(corners, corner) == pytest.approx(pure, abs=1e-12)
    w = np.random.default_rng(1).dirichlet(np.ones(m))
    assert simplex.barycentric(corners, w @ corners) == pytest.approx(w)


def test_a_sles_takes_steps_of_equal_length_and_fewer_between_similar_maps():
    distances = np.array([[0.0, 0.895, 0.430], [0.895, 0.0, 0.875], [0.430, 0.875, 0.0]])  # the published case
    lattice = simplex.adaptive(distances, 0.05, np.full(3, 1.0 / 3.0))
    episodes = simplex.breadth_first(lattice, np.full(3, 1.0 / 3.0))
    assert episodes[0].weights == pytest.approx(np.full(3, 1.0 / 3.0))
    weights = np.array([episode.weights for episode in episodes])
    assert weights.min() >= 0.0
    assert weights.sum(axis=1) == pytest.approx(1.0)
    corners = simplex.embedded(distances)
    for episode in episodes[1:]:
        step = (episode.weights - episodes[episode.parent].weights) @ corners
        assert np.linalg.norm(step) == pytest.approx(0.05)
    area = 0.5 * abs(np.linalg.det(corners[1:]))
    assert len(episodes) == pytest.approx(area / 0.05**2, rel=0.2)  # theirs: 84
    ends = simplex.with_corners(episodes, 3)
    assert {tuple(episode.weights) for episode in ends} >= {(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)}
    assert simplex.with_corners(ends, 3) == ends


@pytest.mark.parametrize(
    ("phi", "which"),
    [
        ([[0.0, 0.0], [0.0, 0.0]], 2),
        ([[0.0, 0.0], [1.0, 1.0], [0.5, 0.5]], 3),
        ([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]], 4),
    ],
)
def test_maps_that_span_no_simplex_are_named(phi, which):
    points = np.array(phi)
    with pytest.raises(DegenerateSimplexError, match=f"map {which} adds nothing to those before it"):
        simplex.embedded(np.linalg.norm(points[:, None] - points[None], axis=-1))


def test_more_plans_than_make_sense_are_refused_before_the_first():
    with pytest.raises(WeightSpaceError, match=r"steps of 0\.01 over 6 maps are \d+ plans; allowed: at most 5000"):
        simplex.grid(6, 0.01)
    with pytest.raises(
        WeightSpaceError, match=r"steps of 0\.01 between these maps are about \d+ plans; allowed: at most"
    ):
        simplex.adaptive(maps(3)[1], 0.01, np.full(3, 1 / 3))


@pytest.mark.parametrize("m", [2, 3, 4])
def test_scalarised_maps_are_scalarised_objectives_and_no_plan_beats_the_ideal(m):
    phi, distances = maps(m)
    rng = np.random.default_rng(2)
    for w in (*rng.dirichlet(np.ones(m), size=10), *np.eye(m)):
        ideal = ideal_vectors(w[None], distances)[0]
        assert ideal == pytest.approx(((phi - w @ phi) ** 2).sum(axis=1), abs=1e-12)
        c = rng.normal(size=12)
        vector = ((phi - c) ** 2).sum(axis=1)
        assert w @ vector == pytest.approx(((c - w @ phi) ** 2).sum() + w @ ideal)


def test_forecasts_agree_with_what_is_known_and_gaps_are_where_nothing_is():
    distances = np.array([[0.0, 0.9], [0.9, 0.0]])
    known = np.array([[1.0, 0.0], [0.8, 0.2], [0.0, 1.0]])
    found = ideal_vectors(known, distances) + 0.01
    assert forecast(known, known, found, distances) == pytest.approx(found)
    candidates = np.stack((np.linspace(0, 1, 41), np.linspace(1, 0, 41)), axis=1)
    first, second = gaps(candidates, known, found, distances, 2)
    assert 0.2 < first.weights[0] < 0.6  # the wide gap is between 0 and 0.8
    assert first.gain >= second.gain > 0.0
    expected = forecast(first.weights[None], known, found, distances)
    assert first.gain == pytest.approx(hypervolume(np.vstack((found, expected))) - hypervolume(found))
