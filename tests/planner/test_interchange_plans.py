"""Polynomials and waypoints of others become certified plans, or one line that says why not."""

import numpy as np
import pytest

from missions.loader import parse_mission
from planner.errors import CertificateFailed, NotFlyableError
from planner.interchange.errors import InterchangeError
from planner.interchange.minimum_snap import minimum_snap
from planner.interchange.polynomials import flight_plan_of
from planner.interchange.through import flight_through
from planner.interchange.waypoints import Waypoints, parse_waypoints
from planner.trajectory.csv import from_csv, to_csv
from planner.trajectory.encode import decode
from planner.trajectory.encoded import Encoding
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.piecewise import PiecewisePolynomial, concatenated

ANN = "0.5,0.5,0.6\n1.5,0.6,0.6\n1.2,1.3,0.6\n0.6,1.0,0.6\n"


def mission(duration=20.0, encoding="auto", extra="", robots=1, yaw="{type: fixed}"):
    robot = '  - {{name: {}, start: [{}, 0.5], uri: "radio://0/80/2M/E7E7E7E70{}"}}\n'
    names = ("ann", "bob")[:robots]
    text = f"""
schema_version: 1
name: imported
workspace: {{lower: [0.0, 0.0], upper: [4.0, 2.0]}}
horizon: {{duration: {duration}}}
limits: {{acceleration: 0.8, speed: 0.9}}
information: {{type: uniform}}
trajectory: {{encoding: {encoding}, yaw: {yaw}}}
{extra}
robots:
""" + "".join(robot.format(name, 0.5 + 2.0 * k, k + 1) for k, name in enumerate(names))
    return parse_mission(text, path="m.yaml", read_file=lambda _: b"")


def rounds(count, step=2.0, extent=0.4):
    """A trajectory in the plane that comes back to (0.5, 0.5)."""
    angle = np.linspace(0.0, 2.0 * np.pi * round(count / 8), count + 1)
    points = np.zeros((count + 1, 4))
    points[:, 0], points[:, 1], points[:, 2] = 0.9 - extent * np.cos(angle), 0.5 + extent * np.sin(angle), 0.6
    return minimum_snap(step * np.arange(count + 1), points)


@pytest.mark.parametrize(
    ("pieces", "encoding", "legs"), [(10, "auto", 1), (31, "poly4d", 1), (64, "poly4d", 5), (64, "auto", 1)]
)
def test_what_is_exported_comes_back_as_the_same_bytes(pieces, encoding, legs):
    wanted = mission(2.0 * pieces, encoding)
    first = flight_plan_of(wanted, {"ann": rounds(pieces)})
    bytes_of = first.trajectories["ann"]
    assert len(bytes_of.legs) == legs
    again = flight_plan_of(wanted, {"ann": from_csv(to_csv(decode(bytes_of)))})
    assert again.trajectories["ann"] == bytes_of
    assert again.trajectories["ann"].sha256 == bytes_of.sha256
    assert again.certificate == first.certificate


def test_the_plan_is_samples_of_the_bytes():
    flight = flight_plan_of(mission(20.0), {"ann": rounds(10)})
    plan, flown = flight.plan, decode(flight.trajectories["ann"])
    assert plan.q.shape == (201, 1, 2)
    np.testing.assert_array_equal(plan.q[:, 0], flown.evaluate(plan.t)[:, :2])
    np.testing.assert_allclose(plan.v[0] + np.cumsum(plan.u, axis=0)[-1] * plan.dt, 0.0, atol=1e-12)
    assert plan.ergodicity == pytest.approx(flight.certificate.indicators.ergodicity, rel=1e-9)
    assert flight.certificate.passed
    assert flight.transfers is not None


def test_who_ends_early_holds_until_the_search_ends():
    flight = flight_plan_of(mission(200.0), {"ann": rounds(10)})
    flown = decode(flight.trajectories["ann"])
    assert flown.duration == pytest.approx(200.0, abs=1e-3)
    assert flown.pieces == 13  # 180 s in pieces of a minute at most
    np.testing.assert_allclose(flown.evaluate(np.array([20.0, 100.0, 200.0]))[:, :3], [[0.5, 0.5, 0.6]] * 3, atol=1e-6)


def moved(trajectory, axis, power, by):
    coefficients = trajectory.coefficients.copy()
    coefficients[0, axis, power] += by
    return PiecewisePolynomial(trajectory.durations, coefficients)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (
            lambda t: moved(t, 0, 0, 0.01),
            "ann: starts at (0.51, 0.5, 0.6); allowed: robots[0]'s start, (0.5, 0.5, 0.6)",
        ),
        (lambda t: moved(t, 2, 0, 0.4), "starts at (0.5, 0.5, 1)"),
        (lambda t: moved(t, 1, 1, 0.1), "ann: got 0.1 m/s at t = 0 s; allowed: rest"),
        (lambda t: moved(t, 1, 2, 0.1), "ann: got 0.2 m/s² at t = 0 s; allowed: rest"),
        (lambda t: concatenated([t, t]), "ann: lasts 40 s; allowed: at most the mission's horizon.duration, 20 s"),
        (lambda t: PiecewisePolynomial(t.durations[:5], t.coefficients[:5]), "allowed: rest at both ends"),
    ],
)
def test_what_is_no_search_of_this_mission(change, expected):
    with pytest.raises(InterchangeError) as refused:
        flight_plan_of(mission(20.0), {"ann": change(rounds(10))})
    assert expected in str(refused.value)
    assert "\n" not in str(refused.value)


def test_robots_that_do_not_match():
    curve = rounds(10)
    two = mission(20.0, robots=2)
    for given in ({"ann": curve}, {"ann": curve, "eve": curve}, {}):
        with pytest.raises(InterchangeError, match=r"none for .*bob"):
            flight_plan_of(two, given)
    with pytest.raises(InterchangeError, match="eve is no robot of it; allowed: the mission's robots, ann"):
        flight_plan_of(mission(20.0), {"ann": curve, "eve": curve})


@pytest.mark.parametrize("power", [0, 3, 7])
@pytest.mark.parametrize("value", [1e39, 1e300, -1e200, 1e30])
def test_numbers_no_drone_could_mean_are_refused_without_a_warning(power, value):
    with pytest.raises((InterchangeError, TrajectoryError)) as refused:
        flight_plan_of(mission(20.0), {"ann": moved(rounds(10), 0, power, value)})
    assert "\n" not in str(refused.value)


def test_limits_are_certified_not_believed():
    """A jump in the middle, and a curve that is too fast."""
    for curve in (moved(rounds(10), 3, 0, 1.0), rounds(40, step=0.5)):
        with pytest.raises(CertificateFailed):
            flight_plan_of(mission(20.0), {"ann": curve})


def test_two_robots_that_come_too_close():
    """Each on his own is fine; together they are not."""
    points = {"ann": "0,0.5,0.5,0.6\n10,2.0,0.5,0.6\n", "bob": "0,2.5,0.5,0.6\n10,1.5,0.5,0.6\n"}
    with pytest.raises(CertificateFailed) as failed:
        flight_through(mission(20.0, robots=2), {name: parse_waypoints(text) for name, text in points.items()})
    assert "separation" in {check.name for check in failed.value.certificate.checks if not check.passed}


def test_models_for_studies_are_not_flown():
    with pytest.raises(NotFlyableError):
        flight_plan_of(mission(20.0, extra="dynamics: {type: single_integrator}"), {"ann": rounds(10)})


# ------------------------------------------------------------------------------------------------ waypoints


def test_waypoints_are_passed_exactly_and_within_the_limits():
    flight = flight_through(mission(20.0), {"ann": parse_waypoints(ANN)})
    flown = decode(flight.trajectories["ann"])
    assert flown.pieces == 4  # three between waypoints, one that holds
    points = parse_waypoints(ANN).points[:, :3]
    np.testing.assert_allclose(flown.evaluate(flown.knots()[:4])[:, :3], points, atol=1e-6)


@pytest.mark.parametrize("yaw", ["{type: fixed, angle: 1.2}", "{type: path}", "{type: facing, point: [2.0, 1.0]}"])
def test_without_yaw_of_their_own_robots_look_where_the_mission_says(yaw):
    flight = flight_through(mission(20.0, yaw=yaw), {"ann": parse_waypoints(ANN)})
    flown = decode(flight.trajectories["ann"])
    t = np.array([0.0, 1.5, 3.0])
    place, look = flown.evaluate(t)[:, :2], flown.evaluate(t)[:, 3]
    if "facing" in yaw:
        toward = np.array([2.0, 1.0]) - place
        np.testing.assert_allclose(np.cos(look - np.arctan2(toward[:, 1], toward[:, 0])), 1.0, atol=0.02)
    elif "angle" in yaw:
        np.testing.assert_allclose(look, 1.2, atol=1e-6)
    else:
        assert np.ptp(flown.evaluate(np.linspace(0.0, 10.0, 50))[:, 3]) > 1.0


def test_lower_limits_make_it_slower():
    times = []
    for speed, acceleration in ((None, None), (0.4, None), (None, 0.1)):
        flight = flight_through(mission(60.0), {"ann": parse_waypoints(ANN)}, speed=speed, acceleration=acceleration)
        times.append(float(decode(flight.trajectories["ann"]).knots()[3]))
    assert times[1] > 1.2 * times[0]
    assert times[2] > 1.5 * times[0]


def test_given_times_and_yaw_are_kept():
    text = "t,x,y,z,yaw\n0,0.5,0.5,0.6,0\n4,1.5,0.6,0.6,0.7\n9,1.2,1.3,0.6,-1\n"
    flight = flight_through(mission(20.0, yaw="{type: path}"), {"ann": parse_waypoints(text)})
    flown = decode(flight.trajectories["ann"])
    np.testing.assert_allclose(flown.knots(), [0.0, 4.0, 9.0, 20.0], atol=1e-5)
    np.testing.assert_allclose(flown.evaluate(np.array([0.0, 4.0, 9.0, 15.0]))[:, 3], [0.0, 0.7, -1.0, -1.0], atol=1e-5)


def sampled_rounds():
    """Forty-one waypoints, more than 31 pieces can join."""
    times = np.linspace(0.0, 80.0, 41)
    return Waypoints(rounds(40, step=2.0).evaluate(times)[:, :3], times)


@pytest.mark.parametrize("encoding", ["auto", "compressed"])
@pytest.mark.parametrize("timed", [True, False])
def test_more_waypoints_than_float32_pieces_are_fitted_within_the_tolerance(encoding, timed):
    given, wanted = sampled_rounds(), mission(80.0, encoding)
    flight = flight_through(wanted, {"ann": given if timed else Waypoints(given.points)})
    flown = decode(flight.trajectories["ann"])
    everywhere = flown.evaluate(np.linspace(0.0, 80.0, 20_001))[:, :3]
    off = [np.linalg.norm(everywhere - point, axis=1).min() for point in given.points]
    assert max(off) <= wanted.trajectory.tolerance
    if timed:
        at = flown.evaluate(given.times)[:, :3]
        assert np.linalg.norm(at - given.points, axis=1).max() <= wanted.trajectory.tolerance


def test_poly4d_flies_many_waypoints_exactly_in_legs():
    given = sampled_rounds()
    encoded = flight_through(mission(80.0, "poly4d"), {"ann": given}).trajectories["ann"]
    assert len(encoded.legs) > 1
    assert {leg.encoding for leg in encoded.legs} == {Encoding.POLY4D}
    np.testing.assert_allclose(decode(encoded).evaluate(given.times)[:, :3], given.points, atol=1e-5)


def test_waypoints_that_are_refused():
    one = mission(20.0)
    given = parse_waypoints(ANN)
    for arguments, expected in (
        ({"speed": 2.0}, "speed: got 2; allowed: above 0, at most the mission's 0.9 [m/s]"),
        ({"speed": 0.0}, "speed: got 0"),
        ({"acceleration": float("nan")}, "acceleration: got nan"),
        ({"speed": 0.01}, "ann: lasts"),
    ):
        with pytest.raises(InterchangeError) as refused:
            flight_through(one, {"ann": given}, **arguments)
        assert expected in str(refused.value)
    with pytest.raises(InterchangeError, match="eve is no robot"):
        flight_through(one, {"ann": given, "eve": given})
    many = sampled_rounds()
    with pytest.raises(InterchangeError, match="ann: 40 compressed pieces with their own yaw; allowed: at most 31"):
        flight_through(mission(80.0), {"ann": Waypoints(many.points, many.times, 0.01 * many.times)})
    with pytest.raises(InterchangeError, match="ann: waypoint 2 is the one before"):
        flight_through(one, {"ann": Waypoints(np.full((3, 3), 0.5))})
