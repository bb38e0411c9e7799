"""Trajectories longer than the memory: legs that can be written while others fly."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.schema import TrajectorySettings
from planner.trajectory.compressed import decode_compressed, encode_compressed
from planner.trajectory.encode import decode, decode_leg, encode
from planner.trajectory.encoded import MEMORY_SIZE, EncodedTrajectory, Encoding
from planner.trajectory.legs import HALF, choose_joints, overlaps
from tests.planner.long_curves import smooth
from tests.tampering import altered

POLY4D, COMPRESSED = TrajectorySettings(encoding="poly4d"), TrajectorySettings(encoding="compressed")


@pytest.mark.parametrize("settings", [POLY4D, COMPRESSED])
def test_a_chain_decodes_to_the_very_trajectory(settings):
    trajectory = smooth(160)
    encoded = encode(trajectory, settings)
    flown = decode(encoded)
    assert len(encoded.legs) > 2
    assert encoded.pieces == flown.pieces == 160
    if settings is POLY4D:
        assert np.array_equal(flown.coefficients, trajectory.coefficients.astype("<f4"))
        assert np.array_equal(flown.durations, trajectory.durations.astype("<f4"))
    else:
        t = np.linspace(0.0, trajectory.duration, 5000)
        assert np.abs(flown.evaluate(t) - trajectory.evaluate(t))[:, :3].max() < 0.006


def test_compressed_legs_are_rounded_as_one_trajectory():
    trajectory = smooth(60)
    cut = decode(encode(smooth(120), COMPRESSED))
    assert len(encode(trajectory, COMPRESSED).legs) == 1
    joint = cut.knots()[1:-1]
    before, after = cut.evaluate(joint - 1e-9, 1), cut.evaluate(joint, 1)
    assert np.abs(before - after)[:, :3].max() < 0.01  # at the legs' joints as at all others


@given(st.integers(32, 130), st.integers(0, 5), st.sampled_from([POLY4D, COMPRESSED]))
def test_no_leg_is_written_where_another_flies(pieces, seed, settings):
    encoded = encode(smooth(pieces, seed), settings)
    assert encoded.memory <= MEMORY_SIZE
    assert overlaps(encoded) == 0
    for number, leg in enumerate(encoded.legs):
        decode_leg(leg)
        if len(encoded.legs) > 1:
            assert leg.offset == HALF * (number % 2)
            assert len(leg.data) <= HALF


def test_one_leg_stays_what_it_was():
    trajectory = smooth(31)
    (leg,) = encode(trajectory, POLY4D).legs
    assert (leg.offset, leg.pieces, len(leg.data)) == (0, 31, 31 * 132)
    (leg,) = encode(smooth(32), TrajectorySettings()).legs
    assert (leg.encoding, leg.data) == (Encoding.COMPRESSED, encode_compressed(smooth(32)))
    assert decode_compressed(leg.data, 32).pieces == 32


def test_auto_compresses_what_no_memory_holds_for_the_fewest_switches():
    encoded = encode(smooth(160), TrajectorySettings())
    assert encoded.legs[0].encoding is Encoding.COMPRESSED
    assert len(encoded.legs) < len(encode(smooth(160), POLY4D).legs)
    assert f"bytes in {len(encoded.legs)} legs of at most 2048" in encoded.reason


def cost(trajectory, cuts):
    """What choose_joints minimises, spelt out."""
    knots, speed = trajectory.knots(), np.linalg.norm(trajectory.coefficients[:, :3, 1], axis=1)
    hurry = sum(10.0 * max(0.0, 8.0 - (knots[b] - knots[a])) for a, b in itertools.pairwise(cuts))
    return hurry + sum(1.0 + (speed[cut] / 0.1) ** 2 for cut in cuts[1:-1])


@given(st.integers(4, 11), st.integers(0, 50), st.integers(2, 4))
def test_the_cheapest_joints_are_found(pieces, seed, per_leg):
    trajectory = smooth(pieces, seed, length=4.0)
    sizes = np.full(pieces, HALF // per_leg)
    found = choose_joints(trajectory, sizes, 0)
    best = min(
        cost(trajectory, [0, *inner, pieces])
        for count in range(pieces)
        for inner in itertools.combinations(range(1, pieces), count)
        if max(np.diff([0, *inner, pieces])) <= per_leg
    )
    assert max(np.diff(found)) <= per_leg
    assert cost(trajectory, found) == pytest.approx(best)


def test_legs_that_lie_on_one_another_are_seen():
    encoded = EncodedTrajectory(encode(smooth(40), POLY4D).legs[:2])
    assert overlaps(altered(encoded, leg=1, offset=0)) == len(encoded.legs[1].data)
    assert overlaps(altered(encoded, leg=1, offset=len(encoded.legs[0].data) - 4)) == 4
