"""Each policy's mission: it plans, it certifies, and what defines the policy holds on the polynomials that fly.

The judge here knows neither the constraints nor the certificate: it samples the decoded bytes.
"""

import dataclasses
import functools
import itertools
from pathlib import Path

import numpy as np
import pytest

import missions
from missions import load_mission
from missions.schema import SolverSettings
from missions.topology import components
from planner.pipeline import make_flight_plan
from planner.trajectory.encode import decode

FOLDER = Path(missions.__file__).parent / "policies"
PER_STEP = 20  # samples a planning step
SEARCH = SolverSettings(starts=2)  # what limits mean does not depend on how many first guesses raced


@functools.cache
def flown(name):
    """The mission, its flight plan, sample times, distances of all pairs by names (both orders)."""
    mission = load_mission(FOLDER / f"{name}.yaml")
    plan = make_flight_plan(dataclasses.replace(mission, solver=SEARCH))
    t = np.arange(mission.steps * PER_STEP + 1) * (mission.horizon.dt / PER_STEP)
    q = {robot: decode(encoded).evaluate(t)[:, :3] for robot, encoded in plan.trajectories.items()}
    apart = {(a, b): np.linalg.norm(q[a] - q[b], axis=1) for a, b in itertools.permutations(q, 2)}
    return mission, plan, t, q, apart


def names(mission):
    return [robot.name for robot in mission.robots]


def halves(mission, t, *boundaries):
    edges = [0.0, *boundaries, mission.horizon.duration]
    return [(t >= a - 1e-9) & (t <= b + 1e-9) for a, b in itertools.pairwise(edges)]


def at_steps(mission, q, robot, sub_period):
    """Positions at the planning steps of a sub-period, its last instant excluded."""
    t = np.arange(mission.steps) * mission.horizon.dt
    a, b = sub_period
    return q[robot][:-1:PER_STEP, :2][(t >= a - 1e-9) & (t < b - 1e-9)]


def test_every_policy_has_a_mission():
    policies = {load_mission(path).connectivity.policy for path in FOLDER.glob("*.yaml")}
    assert policies == {"probabilistic", "simultaneous", "periodic", "all_time", "guaranteed", "none"}


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.yaml")), ids=lambda path: path.stem)
def test_it_is_certified(path):
    mission, plan, *_ = flown(path.stem)
    assert plan.certificate.passed
    assert mission.name == path.stem


def test_probabilistic():
    mission, _, t, q, apart = flown("probabilistic")
    for pair, least in ((("cf1", "cf2"), 0.3), (("cf2", "cf3"), 0.2)):
        for span, inside in zip(((0.0, 8.0), (8.0, 20.0)), halves(mission, t, 8.0), strict=True):
            a, b = (at_steps(mission, q, robot, span) for robot in pair)
            probability = np.exp(-((a[:, None] - b[None]) ** 2).sum(axis=-1) / (2.0 * 0.5**2)).mean()
            assert probability >= least - 1e-4
            assert apart[pair][inside].min() <= 0.5 + 1e-3, "and they truly meet"


def test_simultaneous():
    mission, _, _, q, _ = flown("simultaneous")
    for other, span in itertools.product(("cf1", "cf3"), ((0.0, 10.0), (10.0, 20.0))):
        a, b = at_steps(mission, q, "cf2", span), at_steps(mission, q, other, span)
        s = ((a - b) ** 2).sum(axis=-1) / 0.5**2
        assert (1.0 / (1.0 + np.exp(4.0 * (s - 1.0)))).mean() >= 0.45 - 1e-4


def test_periodic():
    mission, _, t, _, apart = flown("periodic")
    for pair, instant in itertools.product(itertools.combinations(names(mission), 2), (10.0, 20.0)):
        assert apart[pair][np.isclose(t, instant)] <= 0.5 + 1e-3


def test_all_time():
    mission, _, t, _, apart = flown("all_time")
    robots = names(mission)
    for k in range(len(t)):
        edges = [(i, j) for i, j in itertools.combinations(range(3), 2) if apart[robots[i], robots[j]][k] <= 0.6 + 1e-3]
        assert len(components(3, edges)) == 1, f"at {t[k]:.3f} s"


def runs(within, dt):
    """Lengths [s] of the runs of True."""
    return [dt * (sum(1 for _ in group) - 1) for inside, group in itertools.groupby(within) if inside]


def test_guaranteed():
    mission, _, t, _, apart = flown("guaranteed")
    for pair in itertools.combinations(names(mission), 2):
        for inside in halves(mission, t, 10.0):
            assert max(runs(apart[pair][inside] <= 0.5, t[1])) >= 2.0 - 2.0 * t[1]


def test_connected():
    mission, plan, t, _, apart = flown("connected")
    robots = names(mission)
    for inside in halves(mission, t, 12.0):
        edges = [
            (i, j)
            for i, j in itertools.combinations(range(5), 2)
            if max(runs(apart[robots[i], robots[j]][inside] <= 0.5, t[1]), default=0.0) >= 0.5 - 2.0 * t[1]
        ]
        assert len(components(5, edges)) == 1
    # A tree of contacts in the first half and another in the second: what anybody knew at the start, everybody has.
    found = plan.certificate.indicators
    assert np.isfinite(found.arrivals).all()
    assert len(found.arrivals_by_period) == 2


def test_none_is_the_freest():
    _, plan, *_ = flown("none")
    assert not [check for check in plan.certificate.checks if "conn" in check.name or "contact" in check.name]
    assert plan.certificate.indicators.arrivals, "meetings are reported all the same"
