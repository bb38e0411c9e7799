"""The bound on the connection probability: no motion that keeps the limits may beat it."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import missions
from missions import load_mission
from missions.reach import best_probability
from missions.schema import Horizon, Limits

MISSION = load_mission(Path(missions.__file__).parent / "imec_four_drones.yaml")
POLICY = MISSION.connectivity
A, V, DT, SEPARATION = MISSION.limits.acceleration, MISSION.limits.speed, MISSION.horizon.dt, MISSION.limits.separation


def pair(distance, **limits):
    """Two robots of the IMEC mission, starting this far apart."""
    a, b = MISSION.robots[:2]
    robots = (dataclasses.replace(a, start=(0.0, 0.3)), dataclasses.replace(b, start=(distance, 0.3 + SEPARATION)))
    return dataclasses.replace(MISSION, robots=robots, limits=dataclasses.replace(MISSION.limits, **limits))


def probability(qi, qj):
    """P of one sub-period, from its definition."""
    squares = ((qi[:, None, :] - qj[None, :, :]) ** 2).sum(axis=-1)
    return np.exp(-squares / (2.0 * POLICY.range**2)).mean()


def fly(start, u):
    """Euler-exact motion from rest under piecewise constant accelerations, speed clipped in each step."""
    q, v = np.array(start), np.zeros(2)
    positions = []
    for acceleration in u:
        positions.append(q.copy())
        after = v + acceleration * DT
        after *= min(1.0, V / max(np.linalg.norm(after), 1e-12))
        q, v = q + 0.5 * DT * (v + after), after
    return np.array(positions)


@settings(deadline=None, max_examples=100)
@given(st.floats(0.3, 12.0), st.integers(0, 2**32 - 1), st.booleans())
def test_no_feasible_motion_beats_the_bound(distance, seed, head_on):
    rng = np.random.default_rng(seed)
    u = rng.uniform(-A, A, (2, 100, 2))
    if head_on:  # as fast as possible to where the other one is, passing it at the separation
        u[:, :, 1] = 0.0
        u[0, : int(np.sqrt(distance / A) / DT) + 1, 0] = A
        u[1, : int(np.sqrt(distance / A) / DT) + 1, 0] = -A
    mission = pair(distance)
    qi, qj = fly(mission.robots[0].start, u[0]), fly(mission.robots[1].start, u[1])
    assume((np.linalg.norm(qi - qj, axis=1) >= SEPARATION - 1e-9).all())

    best, i, j = best_probability(mission, POLICY)

    assert (i, j) == (0, 1)
    assert probability(qi, qj) <= best + 1e-9


def test_the_pair_that_starts_farthest_apart_is_the_worst():
    best, i, j = best_probability(MISSION, POLICY)
    assert (i, j) == (0, 3)
    assert best < best_probability(dataclasses.replace(MISSION, robots=MISSION.robots[:2]), POLICY)[0]


def test_the_bound_falls_with_distance_and_rises_with_speed():
    bounds = [best_probability(pair(distance), POLICY)[0] for distance in (0.5, 2.0, 8.0, 30.0)]
    assert bounds == sorted(bounds, reverse=True)
    assert bounds[-1] < 1e-6
    assert best_probability(pair(8.0, speed=2.0), POLICY)[0] > bounds[2]


def test_long_sub_periods_are_bounded_from_above_in_blocks():
    long = dataclasses.replace(pair(12.0), horizon=Horizon(duration=360.0, dt=0.1), limits=Limits(acceleration=0.5))
    n = long.steps // POLICY.sub_periods
    assert n == 1200
    t = np.arange(n) * 0.1
    a = 0.5 * np.sqrt(2.0)
    r = np.where(t < 1.0 / a, 0.5 * a * t**2, t - 0.5 / a)
    gamma = np.exp(-(np.maximum(12.0 - r[:, None] - r[None, :], 0.0) ** 2) / (2.0 * POLICY.range**2))

    best = best_probability(long, POLICY)[0]

    assert gamma.mean() <= best
    assert best == pytest.approx(gamma.mean(), abs=0.02)
