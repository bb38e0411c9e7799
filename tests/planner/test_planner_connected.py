"""Spanning trees and the constraint along them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.spanning import bottlenecks, spanning_trees
from missions.topology import components
from planner.connectivity.pairs import all_pairs
from planner.constraints.base import adapted
from planner.constraints.connected import NOT_ASKED, connected
from planner.dynamics import Motion
from planner.problem import build_problem
from tests.planner.policy_missions import with_policy


def kruskal(weights, pairs, robots):
    """Weight of a minimum spanning tree, and of its heaviest edge."""
    chosen = []
    for row in np.argsort(weights, kind="stable"):
        if len(components(robots, pairs[[*chosen, row]])) < len(components(robots, pairs[chosen])):
            chosen.append(int(row))
    return weights[chosen].sum(), weights[chosen].max()


@given(st.integers(2, 7), st.integers(0, 2**32 - 1))
def test_trees_are_minimal_and_so_is_their_heaviest_edge(robots, seed):
    pairs = all_pairs(robots)
    weights = np.random.default_rng(seed).standard_normal((len(pairs), 3))
    trees, heaviest = spanning_trees(weights, pairs, robots), bottlenecks(weights, pairs, robots)
    for slot in range(3):
        tree = trees[:, slot]
        assert tree.sum() == robots - 1
        assert len(components(robots, pairs[tree])) == 1
        total, worst = kruskal(weights[:, slot], pairs, robots)
        assert weights[tree, slot].sum() == pytest.approx(total)
        assert weights[heaviest[slot], slot] == pytest.approx(worst)


def test_pairs_that_do_not_connect_everybody_give_a_forest():
    pairs = np.array([(0, 1), (2, 3)])
    trees = spanning_trees(np.ones((2, 1)), pairs, 4)
    assert trees.tolist() == [[True], [False]]  # what robot 0 reaches


def standing(*points):
    q = np.broadcast_to(np.array(points), (81, len(points), 2)).copy()
    return Motion(q, np.zeros_like(q), np.zeros_like(q[1:]), np.repeat(q, 2, axis=0)[:-1])


def periodic():
    (constraint,) = (c for c in build_problem(with_policy("periodic, connected")).constraints if c.name == "rendezvous")
    return constraint


def test_it_begins_with_the_tree_of_the_starts():
    constraint = periodic()
    chosen = {tuple(pair) for pair in constraint.pairs[constraint.chosen.all(axis=1)].tolist()}
    assert chosen == {(0, 1), (1, 2), (2, 3)}
    assert (constraint.chosen.sum(axis=0) == 3).all()


def test_only_the_tree_is_asked_for_and_the_best_tree_counts():
    constraint = periodic()
    motion = standing((0.0, 0.0), (0.4, 0.0), (0.4, 2.0), (0.0, 0.4))  # robot 2 is far from everybody
    g = constraint.evaluate(motion).residual
    assert ((g == NOT_ASKED) == ~constraint.chosen).all()
    missed = constraint.violation(motion)
    reach = constraint.inner.range[0]
    assert missed.max() == pytest.approx(np.hypot(0.4, 1.6) - reach)
    assert (missed > NOT_ASKED).sum() == 6  # three pairs at each of the two instants


def test_the_choice_follows_the_motion():
    constraint = periodic()
    motion = standing((0.0, 0.0), (0.4, 0.0), (0.4, 2.0), (0.0, 0.4))
    moved = adapted(constraint, motion)
    assert moved is not constraint
    assert {tuple(p) for p in moved.pairs[moved.chosen.any(axis=1)].tolist()} == {(0, 1), (0, 3), (2, 3)}
    assert adapted(moved, motion) is moved


def test_a_tree_that_is_hardly_better_does_not_replace_the_one_in_use():
    inner = periodic().inner
    before = connected(inner, standing((0.0, 0.0), (0.4, 0.0), (1.19, 1.2), (0.0, 0.4)))  # 2-3 is 3 mm shorter than 1-2
    after = standing((0.0, 0.0), (0.4, 0.0), (1.2, 1.19), (0.0, 0.4))  # 3 mm longer
    assert adapted(before, after) is before
    assert (connected(inner, after).chosen != before.chosen).any()
    assert adapted(before, standing((0.0, 0.0), (0.4, 0.0), (1.4, 0.8), (0.0, 0.4))) is not before
