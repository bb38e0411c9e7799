"""Everything about space, end to end: wherever the workspace lies, in three dimensions, in layers, among zones."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import missions
from missions import load_mission
from missions.obstacles import BoxObstacle, CircleObstacle, CylinderObstacle
from missions.schema import GaussianMixtureMap, Horizon, NoConnectivity, Robot, Workspace
from planner.constraints.obstacles import Obstacles
from planner.constraints.paths import When
from planner.constraints.separation import Separation
from planner.errors import CertificateFailed
from planner.indicators import ergodic_metric
from planner.pipeline import make_flight_plan
from planner.problem import build_problem
from planner.solver.scaling import scaled_modes
from planner.solver.solve import solve
from planner.trajectory.fit import fit
from tests.planner.judged import judge_bytes
from tests.planner.problems import furnished, imec, layered, small

FOLDER = Path(missions.__file__).parent / "examples"
ELSEWHERE = {
    "fifty_robots",  # `make bench` takes it to certified bytes
    "round_trip",  # flown, too: tests/deploy/test_round_trip.py
    "three_minutes",  # flown, too: tests/deploy/test_three_minutes.py
    "quadrotor_map",  # a model for studies, not to fly: test_planner_quadrotor.py
    "inspect_four",  # `make bench` takes it to certified bytes; a search around an object: test_surface_search.py
    "inspect_chair",
}
EXAMPLES = sorted(path for path in FOLDER.glob("*.yaml") if path.stem not in ELSEWHERE)


def moved(mission, by):
    """The same mission elsewhere: everything in it shifted by (x, y) [m]."""

    def shift(point):
        return None if point is None else (point[0] + by[0], point[1] + by[1], *point[2:])

    def shift_shape(shape):
        if isinstance(shape, CircleObstacle | CylinderObstacle):
            return dataclasses.replace(shape, center=shift(shape.center))
        if isinstance(shape, BoxObstacle):
            return dataclasses.replace(shape, lower=shift(shape.lower), upper=shift(shape.upper))
        return dataclasses.replace(shape, vertices=tuple(shift(vertex) for vertex in shape.vertices))

    information = mission.information
    if isinstance(information, GaussianMixtureMap):
        components = tuple(dataclasses.replace(c, mean=shift(c.mean)) for c in information.components)
        information = dataclasses.replace(information, components=components)
    robots = tuple(
        dataclasses.replace(r, start=shift(r.start), end=r.end if r.end == "start" else shift(r.end))
        for r in mission.robots
    )
    return dataclasses.replace(
        mission,
        workspace=Workspace(shift(mission.workspace.lower), shift(mission.workspace.upper)),
        information=information,
        robots=robots,
        obstacles=tuple(shift_shape(shape) for shape in mission.obstacles),
        zones=tuple(shift_shape(zone) for zone in mission.zones),
    )


@pytest.mark.parametrize("mission", [imec(), layered(), furnished()], ids=lambda m: m.name)
def test_nothing_depends_on_where_the_workspace_lies(mission):
    by = np.array([64.0, -32.0])
    here, there = build_problem(mission), build_problem(moved(mission, by))
    modes_here, modes_there = scaled_modes(here), scaled_modes(there)
    _, robots, nu = here.dynamics.controls_shape
    z = 0.4 * np.random.default_rng(0).standard_normal((modes_here.S.shape[1], robots, nu))
    motion, other = here.dynamics.rollout(modes_here.controls(z)), there.dynamics.rollout(modes_there.controls(z))
    np.testing.assert_allclose(other.q[..., :2], motion.q[..., :2] + by, atol=1e-9)
    assert there.metric.value(other.q[:-1]) == pytest.approx(here.metric.value(motion.q[:-1]), rel=1e-9)
    assert [c.name for c in here.constraints] == [c.name for c in there.constraints]
    for a, b in zip(here.constraints, there.constraints, strict=True):
        np.testing.assert_allclose(b.evaluate(other).residual, a.evaluate(motion).residual, atol=1e-9)


def test_the_metric_of_a_box_off_the_origin_is_that_of_the_unit_box():
    mission = small()
    by = np.array([7.0, -3.0])
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (50, 2, 2))
    E = ergodic_metric(mission).value(q)
    assert ergodic_metric(moved(mission, by)).value(q + by) == pytest.approx(E, rel=1e-9)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_plan_and_are_certified(path):
    judge_bytes(make_flight_plan(load_mission(path)))


def test_layers_may_cross_where_their_heights_allow_it():
    """Two robots that have to pass each other in a corridor narrower than the separation can, one above the other."""
    corridor = small(
        NoConnectivity(),
        workspace=Workspace((-1.0, -0.1), (1.0, 0.1)),
        information=GaussianMixtureMap(small().information.components[:1]),
        robots=(
            Robot("low", (-0.9, 0.0), altitude=0.5, end=(0.9, 0.0)),
            Robot("high", (0.9, 0.0), altitude=1.1, end=(-0.9, 0.0)),
        ),
        obstacles=(),
    )
    outcome = solve(build_problem(corridor), corridor.solver)
    assert outcome.plan is not None
    apart = np.abs(outcome.plan.q[:, 0] - outcome.plan.q[:, 1])[:, 0]
    assert apart.min() < corridor.limits.separation
    np.testing.assert_allclose(outcome.plan.q[-1], [(0.9, 0.0), (-0.9, 0.0)], atol=1e-9)


def test_a_start_in_motion_plans_and_fits_but_is_certified_for_no_flight():
    mission = small(NoConnectivity(), robots=(Robot("r0", (-0.6, -0.6), velocity=(0.3, 0.0)),))
    outcome = solve(build_problem(mission), mission.solver)
    assert outcome.plan is not None
    np.testing.assert_array_equal(outcome.plan.v[0], [(0.3, 0.0)])
    (trajectory,) = fit(outcome.plan, mission)
    np.testing.assert_allclose(trajectory.evaluate(np.zeros(1), 1)[0, :2], (0.3, 0.0), atol=1e-6)
    with pytest.raises(CertificateFailed) as caught:
        make_flight_plan(mission)
    failed = [check for check in caught.value.certificate.checks if not check.passed]
    assert [(check.name, check.where, check.time) for check in failed] == [("velocity at rest", "r0", 0.0)]


def test_fifty_robots_are_a_problem():
    mission = load_mission(FOLDER / "fifty_robots.yaml")
    problem = build_problem(mission)
    motion = problem.dynamics.rollout(np.zeros(problem.dynamics.controls_shape))
    found = {c.name: float(c.violation(motion).max()) for c in problem.constraints}
    assert found["separation"] < 0.0
    assert found["connection"] < 0.0, "starts are neighbours in the ring"
    assert problem.metric.value(motion.q[:-1]) > 1e-3, "and there is something to search"


def test_what_is_between_samples_counts_where_margins_do_not_cover_it():
    """At 1 m/s, samples half of 0.1 s apart miss 1 mm of 0.3 m, of 0.1 m three times as much."""
    radii = {0.3: When.SAMPLES, 0.1: When.ALWAYS}
    for radius, when in radii.items():
        problem = build_problem(imec(obstacles=(CircleObstacle((1.3, 1.5), radius),)))
        circles = next(c for c in problem.constraints if isinstance(c, Obstacles))
        assert circles.when is when
    slow = build_problem(imec(horizon=Horizon(30.0, 0.5)))
    assert {c.when for c in slow.constraints if isinstance(c, Separation | Obstacles)} == {When.ALWAYS}
    assert problem.coarse is not None
    assert {c.when for c in problem.coarse.constraints if isinstance(c, Separation | Obstacles)} == {When.CHORDS}
