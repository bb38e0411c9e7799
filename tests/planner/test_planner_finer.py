"""Plans with long steps go on with short ones: sub-periods stay; what is stored has the steps of the mission."""

import dataclasses

import numpy as np
import pytest

from missions.schema import Horizon
from missions.topology import sub_period_times
from planner import pipeline
from planner.finer import FEWEST, LONGEST, at_steps, finer, smooth_modes, smoother
from planner.pipeline import make_flight_plan
from planner.plan import Plan
from planner.problem import build_problem
from planner.solver.scaling import scaled_modes
from planner.trajectory.errors import TrajectoryError
from tests.planner.problems import imec, scaling, small


def test_short_steps_are_as_they_are():
    assert finer(imec()) is None


@pytest.mark.parametrize("dt", [0.3, 0.5, 1.0])
def test_sub_periods_stay_where_they_are(dt):
    """A third of 100 steps is no whole number of steps, on any grid."""
    mission = scaling(5, sub_periods=3, horizon=Horizon(100.0 * dt, dt))
    fine = finer(mission)
    assert fine is not None
    assert fine.horizon.dt <= LONGEST
    assert fine.steps % mission.steps == 0
    assert fine.horizon.duration == mission.horizon.duration
    np.testing.assert_allclose(sub_period_times(fine), sub_period_times(mission), atol=1e-9)


def test_controls_of_the_finer_grid_are_smooth():
    """Half as fast again at the ends, no more: a third of what the steps could hold."""
    mission = scaling(5)
    fine = finer(mission)
    S = scaled_modes(build_problem(fine, modes=smooth_modes(mission))).S
    k = np.arange(fine.steps)
    spectrum = np.cos(np.pi / fine.steps * np.outer(k, k + 0.5)) @ S
    assert abs(spectrum[int(1.5 * 70) + 1 :]).max() < 1e-9 * abs(spectrum).max()


def test_a_fine_plan_at_the_missions_steps():
    mission = scaling(3)
    fine = finer(mission)
    dynamics = build_problem(fine).dynamics
    motion = dynamics.rollout(0.1 * np.random.default_rng(0).standard_normal(dynamics.controls_shape))
    t = np.arange(fine.steps + 1) * fine.horizon.dt
    plan = Plan(t, motion.q, motion.v, motion.u, 1.0, 0.0)
    sampled = at_steps(plan, mission)
    assert sampled.dt == pytest.approx(1.0)
    assert (len(sampled.t), len(sampled.u)) == (mission.steps + 1, mission.steps)
    np.testing.assert_array_equal(sampled.q, plan.q[::4])
    np.testing.assert_allclose(np.diff(sampled.v, axis=0), sampled.u * sampled.dt, atol=1e-12)
    assert at_steps(sampled, mission) is sampled


def test_what_polynomials_cannot_follow_is_planned_with_short_steps(monkeypatch):
    """The first fit is refused: a mission of long steps goes on with short ones, and is stored at its own."""
    mission = small(horizon=Horizon(20.0, 0.5))
    steps, fit = [], pipeline.fit

    def refusing(plan, asked):
        steps.append(plan.dt)
        if len(steps) == 1:
            raise TrajectoryError("cannot be followed")
        return fit(plan, asked)

    monkeypatch.setattr(pipeline, "fit", refusing)
    flight_plan = make_flight_plan(mission)
    assert steps[:2] == pytest.approx([0.5, 0.25])
    assert flight_plan.certificate.passed
    assert len(flight_plan.plan.u) == mission.steps


def test_short_steps_that_cannot_be_followed_get_room_below_the_acceleration_limit(monkeypatch):
    margins, build = [], build_problem

    def built(mission, given, **more):
        margins.append(given)
        return build(mission, given, **more)

    def refused(plan, mission):
        raise TrajectoryError("cannot be followed")

    monkeypatch.setattr(pipeline, "build_problem", built)
    monkeypatch.setattr(pipeline, "fit", refused)
    monkeypatch.setattr(pipeline, "ROUNDS", 2)
    with pytest.raises(TrajectoryError):
        make_flight_plan(small())
    first, second = margins
    assert second == dataclasses.replace(first, acceleration=first.acceleration + pipeline.STIFFER)


def test_what_shakes_on_short_steps_gets_fewer_modes_until_hardly_any_are_left():
    mission = imec()
    modes, seen = smoother(mission, None), []
    while modes is not None:
        seen.append(modes)
        modes = smoother(mission, modes)
    assert seen[0] == 75
    assert seen == sorted(seen, reverse=True)
    assert seen[-1] >= FEWEST > 0.75 * seen[-1] - 1
