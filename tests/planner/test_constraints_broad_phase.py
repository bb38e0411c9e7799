import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.connectivity.pairs import all_pairs
from planner.constraints import separation
from planner.constraints.blocks import BLOCK, box_gaps
from planner.constraints.separation import Separation
from planner.dynamics import Cotangent, Motion


def swarm(robots, samples, side, seed, nu=2):
    rng = np.random.default_rng(seed)
    q = rng.uniform(0.0, side, (1, robots, nu)) + 0.02 * rng.standard_normal((samples, robots, nu)).cumsum(axis=0)
    return Motion(q[::2], np.zeros_like(q[::2]), np.zeros_like(q[1::2]), q)


def constraint(robots, scale=None):
    pairs = all_pairs(robots)
    return Separation(pairs, np.full(len(pairs), 0.3), tuple(map(str, range(robots))), 0.05, scale)


@given(st.integers(0, 1000), st.integers(2, 8), st.integers(1, 70), st.floats(0.1, 5.0))
@settings(max_examples=50, deadline=None)
def test_boxes_are_never_farther_apart_than_what_is_in_them(seed, robots, samples, side):
    x = np.ascontiguousarray(swarm(robots, samples, side, seed).q_fine.T)
    pairs = all_pairs(robots)
    delta = x[:, pairs[:, 0]] - x[:, pairs[:, 1]]
    gaps = np.repeat(box_gaps(x, pairs), BLOCK, axis=1)[:, :samples]
    assert (gaps <= (delta**2).sum(axis=0) + 1e-12).all()


def test_the_broad_phase_changes_nothing_that_acts(monkeypatch):
    """Residuals, gradients: the same wherever a constraint is near its limit, far below zero elsewhere."""
    for scale, nu in ((None, 2), (np.array([1.0, 1.0, 0.4]), 3)):
        motion = swarm(20, 201, 2.0, 5, nu)
        fast, cotangent = constraint(20, scale).evaluate(motion), Cotangent.zeros_like(motion)
        monkeypatch.setattr(separation, "MANY_PAIRS", 10**9)
        slow, expected = constraint(20, scale).evaluate(motion), Cotangent.zeros_like(motion)
        monkeypatch.undo()
        near = slow.residual > -0.4
        assert 0 < near.sum() < near.size / 2
        np.testing.assert_allclose(fast.residual[near], slow.residual[near], atol=1e-12)
        assert (fast.residual >= slow.residual - 1e-12).all()  # a bound
        assert fast.residual[~near].max() < -0.3
        fast.pull(np.maximum(fast.residual, 0.0), cotangent)
        slow.pull(np.maximum(slow.residual, 0.0), expected)
        np.testing.assert_allclose(cotangent.q_fine, expected.q_fine, atol=1e-12)
        assert np.abs(expected.q_fine).max() > 0.0
