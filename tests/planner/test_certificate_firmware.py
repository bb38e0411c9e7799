"""What stands between exact polynomials and the drone: float32, its clock, the radio."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from missions.radio import Radio, background_rate
from planner.certificate.certify import certify
from planner.certificate.compare import differences
from planner.certificate.firmware import TICK, UPTIME, firmware_checks, float32_rounding
from planner.certificate.radio import upload_requests
from planner.trajectory.encode import decode, encode
from planner.trajectory.piecewise import PiecewisePolynomial
from tests.planner.test_certificate_certify import check_named, failed, good, mission

KINDS = ("separation", "obstacles", "workspace", "speed", "thrust", "memory")


@settings(max_examples=60, deadline=None)
@given(
    hnp.arrays(np.float32, (1, 4, 8), elements=st.floats(-4, 4, width=32)), st.sampled_from([0.25, 1.0, 2.5]), st.data()
)
def test_float32_horner_on_a_float32_clock_stays_within_the_bound(coefficients, duration, data):
    """The firmware's arithmetic, for a drone that was switched on an hour ago."""
    exact = PiecewisePolynomial([duration], coefficients.astype(float))
    started = np.float32(UPTIME)
    now = np.float32(UPTIME + data.draw(st.floats(0.0, duration)))
    t = now - started
    flown = np.zeros(3, dtype=np.float32)
    for k in range(7, -1, -1):
        flown = flown * t + coefficients[0, :3, k]
    error = np.linalg.norm(flown.astype(float) - exact.evaluate(float(now) - UPTIME)[0, :3])
    assert flown.dtype == np.float32
    assert error <= float32_rounding(exact).value


def test_pieces_whose_terms_cancel_are_caught():
    """Twice a million metres that cancel: exact numbers are fine, float32 is not."""
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, 0, 6:] = 1e6, -1e6
    checks = {check.name: check for check in firmware_checks("a", PiecewisePolynomial([1.0], coefficients))}
    assert checks["float32 rounding"].fails
    assert checks["shortest piece"].passed


def test_pieces_shorter_than_a_tick_are_a_warning():
    resting = np.zeros((2, 4, 8))
    check = firmware_checks("a", PiecewisePolynomial([5.0, 0.5 * TICK], resting))[1]
    assert (check.name, check.passed, check.fails, check.time) == ("shortest piece", False, False, 5.0)


def test_a_dongle_with_too_many_drones_is_a_warning():
    certificate = certify(mission(radio=Radio(packet_rate=150.0)), good())
    assert certificate.passed
    assert {check.name for check in certificate.warnings} == {"radio load", "upload time"}
    load = check_named(certificate, "radio load")
    assert load.value == 2 * background_rate(mission())
    assert "2 drones" in load.where
    assert check_named(certificate, "upload time").value == np.inf


def test_upload_time_counts_every_chunk_twice():
    certificate = certify(mission(), good())
    requests = upload_requests(good()["a"])
    assert requests == 2 * -(-good()["a"].size // 24) + 1
    rate = (mission().radio.packet_rate / 2 - background_rate(mission())) / 2
    assert check_named(certificate, "upload time").value == pytest.approx(requests / rate)


def test_a_certificate_agrees_with_itself_and_with_no_other():
    one = certify(mission(), good())
    assert differences(one, certify(mission(), good())) == ()
    kind = check_named(one, "separation")
    for change in ({"value": kind.value + 0.01}, {"limit": 0.2}, {"passed": False}, {"severity": "warning"}):
        edited = tuple(dataclasses.replace(c, **change) if c is kind else c for c in one.checks)
        assert differences(dataclasses.replace(one, checks=edited), one) == ("separation",)
    assert differences(dataclasses.replace(one, checks=one.checks[1:]), one) == ("separation",)
    assert differences(one, dataclasses.replace(one, checks=one.checks[1:])) == ("separation",)
    assert differences(dataclasses.replace(one, mission_sha256=""), one) == ("mission",)
    assert differences(dataclasses.replace(one, trajectories_sha256=()), one) == ("trajectories",)


def test_compressed_bytes_are_certified_alike():
    settings_ = dataclasses.replace(mission().trajectory, encoding="compressed")
    again = {name: encode(decode(item), settings_) for name, item in good().items()}
    certificate = certify(mission(), again)
    assert failed(certificate) <= {"acceleration jump", "acceleration at rest", "velocity at rest"}, "1 mm is coarse"
    for name in KINDS:
        assert check_named(certificate, name).passed
