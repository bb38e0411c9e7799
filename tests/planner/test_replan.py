"""The rest of a plan, planned anew: what has been flown counts and stays, and motion goes on where it was."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions import MissionError
from missions.connectivity import GuaranteedConnectivity, PeriodicConnectivity, ProbabilisticConnectivity
from missions.replanning import one_line, with_information, with_information_text
from missions.schema import Gaussian, GaussianMixtureMap, UniformMap
from planner.dynamics import DoubleIntegrator
from planner.ergodic.basis import CosineBasis
from planner.ergodic.metric import ErgodicMetric
from planner.errors import NoFeasiblePlan, PlannerError
from planner.margins import Margins
from planner.plan import Plan
from planner.problem import build_problem
from planner.replan import Sensing, consumed, planned_anew
from planner.replan.anew import Effort, replan
from planner.replan.rest import rest_of, rest_problem, what_is_left
from planner.solver.solve import solve
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.knots import through
from planner.trajectory.legs import QUARTER, legs_between
from planner.trajectory.piecewise import PiecewisePolynomial
from tests.deploy import replan_bench as bench
from tests.planner.problems import small

CHANGED = GaussianMixtureMap((Gaussian((2.0, 0.6), 0.05),))


@pytest.fixture(scope="module")
def mission():
    return small()


@pytest.fixture(scope="module")
def plan(mission):
    return solve(build_problem(mission), mission.solver).plan


@pytest.fixture(scope="module")
def changed(mission):
    return dataclasses.replace(mission, information=CHANGED)


@pytest.fixture(scope="module", params=[0.3, 0.6])
def anew(request, changed, plan):
    step = round(request.param * changed.steps)
    return step, planned_anew(changed, plan, step)


# ------------------------------------------------------------------------------------------------ what counts


@given(seed=st.integers(0, 1000), flown=st.integers(0, 19), nu=st.sampled_from([2, 3]))
@settings(max_examples=40, deadline=None)
def test_ergodicity_of_the_whole_is_that_of_the_rest_on_what_is_left(seed, flown, nu):
    rng = np.random.default_rng(seed)
    basis = CosineBasis(np.zeros(nu), np.ones(nu) * 2.0, 5)
    phi_k = rng.normal(size=(5,) * nu)
    phi_k.flat[0] = 1.0
    metric, q = ErgodicMetric(basis, phi_k), rng.uniform(0.0, 2.0, (20, 3, nu))
    left = what_is_left(metric, q[:flown], 20)
    share = flown / 20
    assert left.phi_k.flat[0] == pytest.approx(1.0)
    assert metric.value(q) == pytest.approx((1.0 - share) ** 2 * left.value(q[flown:]), rel=1e-9, abs=1e-12)


def test_what_has_been_flown_stays(plan, anew):
    step, new = anew
    assert np.array_equal(new.q[:step], plan.q[:step])
    assert np.array_equal(new.u[:step], plan.u[:step])
    assert np.array_equal(new.t, plan.t)


def test_motion_goes_on_where_it_was(mission, plan, anew):
    """Position and velocity exactly; the acceleration within what it may change in two steps of a second's fading."""
    step, new = anew
    assert np.allclose(new.q[step], plan.q[step], atol=1e-12)
    assert np.allclose(new.v[step], plan.v[step], atol=1e-12)
    rolled = DoubleIntegrator(plan.q[0], mission.steps, mission.horizon.dt).rollout(new.u)
    assert np.allclose(rolled.q, new.q, atol=1e-9)
    assert np.allclose(rolled.v[-1], 0.0, atol=1e-9)


def test_controls_begin_with_the_acceleration_that_is_given(mission):
    """Whatever the variables: modes vanish at the beginning, but for the wave packets of the first steps."""
    start = np.zeros((len(mission.robots), 2, 3))
    start[..., 0] = [robot.start for robot in mission.robots]
    start[..., 1], start[..., 2] = 0.1, [0.3, -0.2]
    from planner.solver.scaling import scaled_modes

    _, problem = rest_problem(mission, 0, start, None, Margins())
    modes = scaled_modes(problem)
    zero = modes.controls(np.zeros((modes.S.shape[1], len(mission.robots), 2)))
    assert np.allclose(zero[0], start[..., 2], atol=0.03)
    motion = problem.dynamics.rollout(zero)
    assert np.allclose(motion.v[0], 0.1)
    assert np.allclose(motion.v[-1], 0.0, atol=1e-9)


def test_a_new_plan_is_better_on_the_new_map(changed, plan, anew):
    _, new = anew
    metric = build_problem(changed).metric
    assert new.ergodicity == pytest.approx(metric.value(new.q[:-1]))
    assert new.ergodicity < metric.value(plan.q[:-1])
    assert new.violation <= 1e-3


def test_no_history_no_debt(changed, plan):
    """On a map from which what was seen has been taken off, what has been flown does not count."""
    step = changed.steps // 2
    new = planned_anew(changed, plan, step, history=False)
    metric = build_problem(changed).metric
    counted = planned_anew(changed, plan, step)
    assert metric.value(new.q[step:-1]) < metric.value(counted.q[step:-1])


def test_too_little_work_is_no_plan(changed, plan):
    with pytest.raises(NoFeasiblePlan, match="no plan that meets every limit"):
        planned_anew(changed, plan, 10, effort=Effort(rounds=1))


def test_steps_beyond_the_plan_are_refused(changed, plan):
    with pytest.raises(PlannerError, match=r"got step 1000; allowed: 0 to \d+"):
        planned_anew(changed, plan, 1000)


# ------------------------------------------------------------------------------------------------ the rest


def test_the_rest_of_a_mission(mission):
    policy = ProbabilisticConnectivity(range=0.5, sub_periods=4, threshold=0.2)
    whole = dataclasses.replace(mission, connectivity=policy)
    step = round(0.4 * whole.steps)  # in the second sub-period
    q = np.array([robot.start for robot in mission.robots]) + 0.01
    rest = rest_of(whole, step, q)
    since, T = step * whole.horizon.dt, whole.horizon.duration
    assert rest.horizon.duration == pytest.approx(T - since)
    assert rest.connectivity.boundaries == pytest.approx((0.5 * T - since, 0.75 * T - since))
    assert np.array([robot.start for robot in rest.robots]) == pytest.approx(q)
    assert [robot.pad for robot in rest.robots] == [robot.start[:2] for robot in mission.robots]
    last = rest_of(whole, round(0.9 * whole.steps), q)
    assert last.connectivity.boundaries == ()


def test_rendezvous_that_are_over_are_over(mission):
    T = mission.horizon.duration
    policy = PeriodicConnectivity(range=0.5, instants=(0.25 * T, 0.75 * T))
    rest = rest_of(dataclasses.replace(mission, connectivity=policy), mission.steps // 2, np.zeros((9, 2)))
    assert rest.connectivity.instants == pytest.approx((0.25 * T,))
    guaranteed = GuaranteedConnectivity(range=0.5, sub_periods=2, duration=0.5)
    rest = rest_of(dataclasses.replace(mission, connectivity=guaranteed), mission.steps // 2, np.zeros((9, 2)))
    assert rest.connectivity.boundaries == ()


# ------------------------------------------------------------------------------------------------ consumption


@given(seed=st.integers(0, 1000), rate=st.floats(0.0, 5.0))
@settings(max_examples=30, deadline=None)
def test_looking_uses_information_up_only_where_somebody_looked(seed, rate):
    rng = np.random.default_rng(seed)
    density, q = rng.uniform(0.0, 1.0, (30, 20)), rng.uniform(0.0, [0.5, 1.0], (7, 2, 2))
    sensing = Sensing(radius=0.05, rate=rate)
    left = consumed(density, np.zeros(2), np.array([1.5, 1.0]), q, 0.3, sensing)
    assert (left <= density).all()
    assert (left >= 0.0).all()
    assert np.allclose(left[20:], density[20:], rtol=1e-9)  # half a metre away
    half = consumed(density, np.zeros(2), np.array([1.5, 1.0]), q[:3], 0.3, sensing)
    both = consumed(half, np.zeros(2), np.array([1.5, 1.0]), q[3:], 0.3, sensing)
    assert np.allclose(both, left, rtol=1e-12)  # it does not matter when


def test_consumption_in_the_middle_of_a_look():
    q = np.full((1, 1, 3), 0.5)
    left = consumed(np.ones((5, 5, 5)), np.zeros(3), np.ones(3), q, 2.0, Sensing(radius=0.1, rate=0.5))
    assert left[2, 2, 2] == pytest.approx(math.exp(-1.0))
    with pytest.raises(PlannerError, match="map of 3 axes and positions of 2"):
        consumed(np.ones((5, 5, 5)), np.zeros(3), np.ones(3), q[..., :2], 2.0, Sensing(0.1, 0.5))
    with pytest.raises(PlannerError, match="radius 0"):
        Sensing(0.0, 1.0)


# ------------------------------------------------------------------------------------------------ joints and legs


@given(
    inner=st.lists(st.floats(0.5, 39.5), min_size=0, max_size=30, unique=True),
    joints=st.lists(st.integers(4, 36), min_size=0, max_size=3, unique=True),
)
def test_knots_go_through_joints(inner, joints):
    knots = np.array([0.0, *sorted(inner), 40.0])
    joints = tuple(map(float, sorted(joints)))
    moved = through(knots, joints)
    assert set(joints) <= set(moved)
    assert moved[0] == 0.0
    assert moved[-1] == 40.0
    assert (np.diff(moved) >= 0.0).all()


def _straight(pieces, length=1.0):
    coefficients = np.zeros((pieces, 4, 8))
    rng = np.random.default_rng(0)
    coefficients[:, :2] = 0.05 * rng.normal(size=(pieces, 2, 8))
    return PiecewisePolynomial(np.full(pieces, length), coefficients)


def test_legs_that_do_not_fit_are_refused():
    with pytest.raises(TrajectoryError, match=f"between joints {QUARTER} are allowed"):
        legs_between(_straight(80), (40.0,))
    with pytest.raises(TrajectoryError, match="no piece ends at a joint"):
        legs_between(_straight(20), (10.4,))


def test_there_is_no_such_joint():
    mission = bench.mission()
    with pytest.raises(PlannerError, match="got joint 3; allowed: 0 to 2"):
        replan(None, mission, 3)  # type: ignore[arg-type]


# ------------------------------------------------------------------------------------------------ the mission


def test_another_map_is_written_into_the_missions_text():
    mission = bench.mission()
    for new in (CHANGED, UniformMap()):
        other = with_information(mission, new)
        assert other.information == new
        again = bench.mission(other.source.text)
        assert again.information == new
        assert dataclasses.replace(again, information=mission.information) == mission
        assert other.source.sha256 != mission.source.sha256


def test_told_maps_are_read_like_a_missions():
    mission = bench.mission()
    assert with_information_text(mission, "{type: uniform}").information == UniformMap()
    for text, why in (
        ("[1, 2]", "allowed: a mapping"),
        ("{type: nonsense}", "nonsense"),
        ("{type: [", "no YAML"),
        ("{type: gaussians, components: [{mean: [9.0, 9.0], covariance: 0.01}]}", "nothing inside the workspace"),
    ):
        with pytest.raises(MissionError, match=why):
            with_information_text(mission, text)
    assert "\n" not in one_line("type: gaussians\ncomponents:\n  - {mean: [1.0, 1.0], covariance: 0.1}\n")


@pytest.mark.parametrize(
    ("old", "new", "where"),
    [
        ("joints: [8.0, 16.0, 24.0]", "joints: [8.0, 16.1, 24.0]", r"joints\[1\]: got 16.1; allowed: whole mult"),
        ("joints: [8.0, 16.0, 24.0]", "joints: [8.0, 15.0, 24.0]", r"joints\[1\]: got 15; allowed: at least 8 s"),
        ("joints: [8.0, 16.0, 24.0]", "joints: [8.0, 16.0, 25.0]", r"joints\[2\]: got 25; allowed: at least 8 s"),
        ("joints: [8.0, 16.0, 24.0]", "joints: [24.0, 16.0, 8.0]", r"joints\[1\]: got 16; allowed: at least 8 s"),
        ("  joints: [8.0, 16.0, 24.0]\n", "", "changes: got changes without joints"),
        ("time: 10.0", "time: 1.0", r"changes\[1\].time: got 1; allowed: 2 or later"),
        ("time: 18.0", "time: 22.0", r"changes\[2\].time: got 22; allowed: before 21"),
        ("mean: [2.2, 0.7]", "mean: [2.2]", r"changes\[0\].information.components\[0\].mean"),
        ("budget: 3.0", "budget: 0.0", "budget: got 0.0; allowed: above 0"),
        ("solver:", "trajectory: {encoding: poly4d}\nsolver:", "trajectory.encoding: got poly4d with joints"),
        ("solver:", "trajectory: {yaw: {type: path}}\nsolver:", "trajectory.yaw: got path with joints"),
        ("solver:", "dynamics: {type: single_integrator}\nsolver:", "replanning.joints: got joints; allowed"),
    ],
)
def test_what_cannot_be_planned_anew_is_refused_where_it_stands(old, new, where):
    assert old in bench.TEXT
    with pytest.raises(MissionError, match=where):
        bench.mission(bench.TEXT.replace(old, new))


def test_plans_are_read_only(anew):
    _, new = anew
    assert isinstance(new, Plan)
    with pytest.raises(ValueError, match="read-only"):
        new.q[0] = 1.0
