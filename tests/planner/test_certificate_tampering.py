"""Tampered, truncated, re-ordered and foreign bytes: refused in one line, by the certificate alone."""

import dataclasses
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.schema import MissionSource
from planner.certificate.certify import certify, verify
from planner.certificate.errors import CertificateError
from planner.errors import PlannerError
from planner.trajectory.encode import decode, encode
from planner.trajectory.encoded import EncodedTrajectory
from tests.planner.test_certificate_certify import PIECES, failed, good, mission

PIECE = 132  # bytes of poly4d
SETTINGS = dataclasses.replace(mission().trajectory, encoding="compressed")
POLY4D = good()
COMPRESSED = {name: encode(decode(item), SETTINGS) for name, item in POLY4D.items()}
CERTIFICATES = {id(swarm): certify(mission(), swarm) for swarm in (POLY4D, COMPRESSED)}
SWARMS = {"poly4d": POLY4D, "compressed": COMPRESSED}


def with_leg(trajectory, **changes):
    """The trajectory with its first leg changed."""
    return EncodedTrajectory((dataclasses.replace(trajectory.legs[0], **changes), *trajectory.legs[1:]))


def with_data(change):
    def edit(swarm):
        leg = swarm["a"].legs[0]
        return {**swarm, "a": with_leg(swarm["a"], data=change(leg.data))}

    return edit


def two_legs(trajectory):
    """The same bytes as two legs."""
    leg = trajectory.legs[0]
    first = dataclasses.replace(leg, data=leg.data[: 2 * PIECE], pieces=2)
    return EncodedTrajectory(
        (first, dataclasses.replace(leg, data=leg.data[2 * PIECE :], pieces=PIECES - 2, offset=2048))
    )


def refusal(swarm, tampered, asked=None):
    """The one line with which the old certificate refuses these bytes."""
    with pytest.raises(CertificateError) as caught:
        verify(CERTIFICATES[id(swarm)], tampered, asked or mission())
    line = str(caught.value)
    assert line
    assert "\n" not in line
    return line


TAMPERINGS = {
    "a byte more": with_data(lambda data: data + b"\0"),
    "a byte less": with_data(lambda data: data[:-1]),
    "a piece less": with_data(lambda data: data[:-PIECE]),
    "nothing": with_data(lambda data: b""),
    "first piece last": with_data(lambda data: data[min(PIECE, len(data) // 2) :] + data[: min(PIECE, len(data) // 2)]),
    "backwards": with_data(lambda data: data[::-1]),
    "swapped robots": lambda swarm: {"a": swarm["b"], "b": swarm["a"]},
    "twice the same": lambda swarm: {**swarm, "b": swarm["a"]},
    "a robot less": lambda swarm: {"a": swarm["a"]},
    "a robot more": lambda swarm: {**swarm, "c": swarm["a"]},
    "another name": lambda swarm: {"a": swarm["a"], "c": swarm["b"]},
    "another piece count": lambda swarm: {**swarm, "a": with_leg(swarm["a"], pieces=PIECES - 1)},
    "another place in memory": lambda swarm: {**swarm, "a": with_leg(swarm["a"], offset=4)},
    "the other encoding": lambda swarm: {**swarm, "a": (COMPRESSED if swarm is POLY4D else POLY4D)["a"]},
}


@pytest.mark.parametrize("kind", SWARMS)
@pytest.mark.parametrize("tampering", TAMPERINGS)
def test_whatever_is_changed_voids_the_certificate(kind, tampering):
    swarm = SWARMS[kind]
    refusal(swarm, TAMPERINGS[tampering](swarm))


@pytest.mark.parametrize("kind", SWARMS)
def test_every_single_byte_counts(kind):
    swarm = SWARMS[kind]
    for name in swarm:
        data = bytearray(swarm[name].legs[0].data)
        for at in range(len(data)):
            data[at] ^= 1 << at % 8
            assert name in refusal(swarm, {**swarm, name: with_leg(swarm[name], data=bytes(data))})
            data[at] ^= 1 << at % 8


def test_the_order_of_legs_and_their_number_count():
    cut = two_legs(POLY4D["a"])
    assert np.array_equal(decode(cut).coefficients, decode(POLY4D["a"]).coefficients)
    assert "bytes of a" in refusal(POLY4D, {**POLY4D, "a": cut})
    legs = {**POLY4D, "a": cut}
    certificate = certify(mission(), legs)
    for changed in (cut.legs[::-1], cut.legs[:1], (*cut.legs, cut.legs[0])):
        with pytest.raises(CertificateError, match="bytes of a are not"):
            verify(certificate, {**POLY4D, "a": EncodedTrajectory(changed)})


def test_another_mission_or_none_voids_it():
    edited = mission(source=MissionSource("m.yaml", "a mission, edited", {}))
    assert "another mission" in refusal(POLY4D, POLY4D, edited)
    with_map = mission(source=MissionSource("m.yaml", "a mission", {"map.png": b"other pixels"}))
    assert "another mission" in refusal(POLY4D, POLY4D, with_map)
    assert "another mission" in refusal(POLY4D, POLY4D, mission(source=None))


# ------------------------------------------------------------------------------------ bytes without a certificate


def judged(swarm):
    """Their own certificate; None if they are refused, in one line."""
    try:
        return certify(mission(), swarm)
    except PlannerError as error:
        lines = str(error).splitlines()
    assert len(lines) == 1
    return None


@pytest.mark.parametrize("kind", SWARMS)
@pytest.mark.parametrize("tampering", TAMPERINGS)
def test_a_new_certificate_is_not_given_by_accident(kind, tampering):
    """Certified afresh, tampered bytes are refused in one line or fail a check; a moved leg flies the same."""
    swarm = SWARMS[kind]
    tampered = TAMPERINGS[tampering](swarm)
    certificate = judged(tampered)
    if certificate is None:
        return
    harmless = {"another place in memory", "the other encoding"}
    missed = failed(certificate) - failed(CERTIFICATES[id(swarm)])
    assert missed or tampering in harmless


def test_pieces_in_another_order_fail_the_checks_they_should():
    certificate = certify(mission(), TAMPERINGS["first piece last"](POLY4D))
    assert {"position jump", "start point"} <= failed(certificate)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, PIECES * PIECE // 4 - 1), st.integers(0, 31))
def test_a_flipped_bit_of_a_number_is_refused_judged_or_too_small_to_matter(number, bit):
    """All that a bit can do unnoticed to a certificate made afresh is less than its tolerances."""
    leg = POLY4D["a"].legs[0]
    data = bytearray(leg.data)
    (value,) = struct.unpack_from("<I", data, 4 * number)
    struct.pack_into("<I", data, 4 * number, value ^ 1 << bit)
    changed = with_leg(POLY4D["a"], data=bytes(data))
    certificate = judged({**POLY4D, "a": changed})
    if certificate is not None and certificate.passed:
        t = np.linspace(0.0, 10.0, 501)
        apart = np.abs(decode(changed).evaluate(t) - decode(POLY4D["a"]).evaluate(t)).max()
        assert apart < 0.02
