"""The certificate: every kind of violation is caught, in the bytes, and named."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.schema import (
    CircleObstacle,
    Flight,
    Horizon,
    Limits,
    Mission,
    MissionSource,
    NoConnectivity,
    ProbabilisticConnectivity,
    Robot,
    UniformMap,
    Workspace,
)
from planner.certificate.certify import certify, verify
from planner.certificate.errors import CertificateError
from planner.trajectory.bezier import control_points as to_points
from planner.trajectory.bezier import power_coefficients
from planner.trajectory.encode import decode, encode
from planner.trajectory.encoded import EncodedTrajectory, Encoding, Leg
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.piecewise import PiecewisePolynomial
from tests.tampering import altered

PIECES, SECONDS = 5, 10.0
STARTS = {"a": (0.5, 0.5), "b": (0.5, 1.0)}
NAMES = tuple(STARTS)


def mission(**changes):
    base = Mission(
        schema_version=1,
        name="there_and_back",
        workspace=Workspace((0.0, 0.0), (3.0, 2.0)),
        horizon=Horizon(SECONDS, 0.1),
        information=UniformMap(),
        robots=tuple(Robot(name, start) for name, start in STARTS.items()),
        limits=Limits(acceleration=1.0, speed=1.5, separation=0.3),
        connectivity=ProbabilisticConnectivity(range=0.6, sub_periods=2, threshold=0.2),
        obstacles=(CircleObstacle((1.5, 1.6), 0.2),),
        flight=Flight(altitude=0.6),
        source=MissionSource("m.yaml", "a mission", {}),
    )
    return dataclasses.replace(base, **changes)


def control_points(start, reach=2.0):
    """(PIECES, 4, 8) points of x = start + reach s(t/T), s from 0 to 1 of degree 7, at rest at both ends."""
    profile = np.zeros(8)
    profile[4:] = 35.0, -84.0, 70.0, -20.0  # 35 s⁴ - 84 s⁵ + 70 s⁶ - 20 s⁷
    out = np.zeros((PIECES, 4, 8))
    for m in range(PIECES):
        shifted = np.polynomial.Polynomial(profile)(np.polynomial.Polynomial([m / PIECES, 1 / PIECES])).coef
        powers = np.zeros((1, 8))
        powers[0, : len(shifted)] = shifted
        out[m, 0] = start[0] + reach * to_points(powers, np.ones(1))[0]
    out[:, 1], out[:, 2] = start[1], 0.6
    return out


def piecewise(points, durations=None):
    durations = np.full(PIECES, SECONDS / PIECES) if durations is None else durations
    return PiecewisePolynomial(durations, power_coefficients(points, durations))


def good():
    return {name: encode(piecewise(control_points(start))) for name, start in STARTS.items()}


def with_points(change, name="a", durations=None):
    """The good bytes with one robot's control points changed."""
    points = control_points(STARTS[name])
    change(points)
    return {**good(), name: encode(piecewise(points, durations))}


def failed(certificate):
    return {check.name for check in certificate.checks if not check.passed}


def check_named(certificate, name):
    return next(check for check in certificate.checks if check.name == name)


def test_good_bytes_pass():
    certificate = certify(mission(), good())
    assert failed(certificate) == set()
    assert certificate.passed
    assert check_named(certificate, "separation").value == pytest.approx(0.5, abs=1e-4)
    assert check_named(certificate, "obstacles").value == pytest.approx(0.4, abs=1e-4)
    assert check_named(certificate, "obstacles").where == "b, obstacles[0]"
    assert check_named(certificate, "workspace").value == pytest.approx(0.5, abs=1e-4)
    assert check_named(certificate, "speed").value == pytest.approx(2.1875 * 2.0 / SECONDS, abs=1e-3)
    assert check_named(certificate, "acceleration").value == pytest.approx(7.5132 * 2.0 / SECONDS**2, abs=1e-3)
    assert certificate.indicators.all_met
    assert certificate.indicators.pairs[0].smallest_distance == pytest.approx(0.5, abs=1e-4)
    assert certificate.indicators.smallest_clearance == pytest.approx(0.4, abs=1e-4)


def into_obstacle(p):
    p[2, 1, 2:6] += 1.26


def into_the_other(p):
    p[2, 1, 3:5] += 0.8


def outside(p):
    p[2, 1, 3:5] -= 2.0


def too_fast(p):
    p[2, 0, 3] -= 4.0
    p[2, 0, 4] += 4.0


def too_hard(p):
    p[2, 0, 3] += 0.6


def other_height(p):
    p[2, 2, 3:5] += 0.01


def step_aside(p):
    p[3:, 1] -= 0.005


def kink(p):
    p[2, 0, 1] += 0.01


def bend(p):
    p[2, 0, 2] += 0.02


def turn(p):
    p[3:, 3] += 0.1


def end_moving(p):
    p[-1, 0, 6] -= 0.02


def end_accelerating(p):
    p[-1, 0, 5] -= 0.02


def elsewhere(p):
    p[:, 0] += 0.002


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (into_obstacle, "obstacles"),
        (into_the_other, "separation"),
        (outside, "workspace"),
        (too_fast, "speed"),
        (too_hard, "acceleration"),
        (other_height, "altitude"),
        (step_aside, "position jump"),
        (kink, "velocity jump"),
        (bend, "acceleration jump"),
        (turn, "yaw jump"),
        (end_moving, "velocity at rest"),
        (end_accelerating, "acceleration at rest"),
        (elsewhere, "start point"),
    ],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_each_kind_of_violation_is_caught(change, expected):
    certificate = certify(mission(), with_points(change))
    assert expected in failed(certificate)
    assert not certificate.passed
    check = check_named(certificate, expected)
    assert "a" in check.where
    assert check.time is not None
    assert 0 <= check.time <= SECONDS


def test_the_reported_time_is_when_it_happens():
    certificate = certify(mission(), with_points(into_the_other))
    check = check_named(certificate, "separation")
    flown = {name: decode(encoded) for name, encoded in with_points(into_the_other).items()}
    at = [flown[name].evaluate(np.array([check.time]))[0, :3] for name in NAMES]
    assert np.linalg.norm(at[0] - at[1]) == pytest.approx(check.value, abs=2e-4)


def test_another_duration_is_caught():
    slow = with_points(lambda p: None, durations=np.full(PIECES, 2.01))
    assert "duration" in failed(certify(mission(), slow))


def test_pairs_that_do_not_connect_are_caught():
    certificate = certify(
        mission(connectivity=ProbabilisticConnectivity(range=0.1, sub_periods=2, threshold=0.2)), good()
    )
    assert failed(certificate) == {"connection probability", "meeting"}
    assert "a–b, sub-period" in check_named(certificate, "connection probability").where
    assert not certificate.indicators.all_met
    assert failed(certify(mission(connectivity=NoConnectivity()), good())) == set()


def test_a_meeting_between_samples_counts():
    """They come within range for 20 ms between two planning steps: exact extrema see it."""
    touch = with_points(into_the_other)
    smallest = certify(mission(), touch).indicators.pairs[0].smallest_distance
    certificate = certify(mission(connectivity=NoConnectivity(range=smallest + 2e-4)), touch)
    assert certificate.indicators.pairs[0].met == (True,)


def test_tolerances_are_declared_and_no_wider():
    base = certify(mission(), good())
    for name, unit in (("separation", "m"), ("speed", "m/s"), ("acceleration", "m/s²"), ("workspace", "m")):
        check = check_named(base, name)
        assert check.unit == unit
        assert 0 < check.tolerance <= max(0.001, 0.01 * check.limit)
    edge = check_named(base, "separation").value
    for limit, passes in ((edge + 0.0009, True), (edge + 0.0011, False)):
        limits = dataclasses.replace(mission().limits, separation=limit)
        assert ("separation" not in failed(certify(mission(limits=limits), good()))) is passes


def test_foreign_and_missing_robots_are_refused():
    bytes_ = good()
    with pytest.raises(CertificateError, match="flies"):
        certify(mission(), {"a": bytes_["a"]})
    with pytest.raises(CertificateError, match="'c'"):
        certify(mission(), {**bytes_, "c": bytes_["a"]})


def test_broken_bytes_are_refused_with_the_robots_name():
    bytes_ = good()
    cut = altered(bytes_["b"], data=bytes_["b"].legs[0].data[:-1])
    with pytest.raises(TrajectoryError, match=r"robot b: .*bytes"):
        certify(mission(), {**bytes_, "b": cut})


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_garbage_is_refused_or_judged_but_never_crashes(data):
    raw = data.draw(st.binary(min_size=132, max_size=132))
    garbage = EncodedTrajectory((Leg(Encoding.POLY4D, raw, 1),))
    try:
        certificate = certify(mission(), {**good(), "a": garbage})
    except TrajectoryError:
        return
    assert not certificate.passed


def test_a_certificate_belongs_to_its_bytes_and_its_mission():
    bytes_ = good()
    certificate = certify(mission(), bytes_)
    verify(certificate, bytes_, mission())
    data = bytearray(bytes_["a"].legs[0].data)
    data[40] ^= 1
    with pytest.raises(CertificateError, match="bytes of a are not"):
        verify(certificate, {**bytes_, "a": altered(bytes_["a"], data=bytes(data))})
    with pytest.raises(CertificateError, match="certificate is for"):
        verify(certificate, {"a": bytes_["a"]})
    with pytest.raises(CertificateError, match="bytes of a, b"):
        verify(certificate, {"a": bytes_["b"], "b": bytes_["a"]})
    with pytest.raises(CertificateError, match="another mission"):
        verify(certificate, bytes_, mission(source=MissionSource("m.yaml", "another", {})))


def test_one_robot_needs_no_partner():
    alone = mission(robots=mission().robots[:1])
    certificate = certify(alone, {"a": good()["a"]})
    assert certificate.passed
    assert certificate.indicators.smallest_separation == np.inf
