"""Bytes: laws of both encodings, and refusal of anything that is no trajectory."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from missions.schema import TrajectorySettings
from planner.trajectory.bezier import control_points, power_coefficients
from planner.trajectory.compressed import END_MARKER, decode_compressed, encode_compressed
from planner.trajectory.encode import decode, encode
from planner.trajectory.encoded import MEMORY_SIZE, EncodedTrajectory, Encoding, Leg
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.trajectory.poly4d import MAX_PIECES, PIECE_SIZE, decode_poly4d, encode_poly4d
from tests.tampering import altered

COMPRESSED = TrajectorySettings(encoding="compressed")
SINGLE = 4e-4  # [m], [rad] the firmware's single precision on wild curves of 3 m; smooth ones keep to 1e-5


@st.composite
def trajectories(draw, most=MAX_PIECES, milliseconds=(1, 60_000), reach=30.0):
    """Pieces with random control points; not continuous, which encoders must not care about."""
    pieces = draw(st.integers(1, most))
    durations = draw(hnp.arrays(np.int64, pieces, elements=st.integers(*milliseconds))) / 1e3
    points = draw(hnp.arrays(np.float64, (pieces, 4, 8), elements=st.floats(-reach, reach, width=32)))
    return PiecewisePolynomial(durations, power_coefficients(points, durations))


def smooth(pieces=6, seconds=0.9, seed=0, reach=2.0):
    """A C³ random curve at rest at both ends, yaw and z constant; pieces of ``seconds``, one or one each."""
    rng = np.random.default_rng(seed)
    knots = np.zeros((pieces + 1, 4, 4))  # state, axis
    knots[1:-1, :, :2] = rng.uniform(-1, 1, (pieces - 1, 4, 2)) * np.array([reach, 1.0, 0.5, 0.5])[:, None]
    knots[[0, -1], 0, :2] = rng.uniform(-reach, reach, (2, 2))
    durations = np.broadcast_to(np.asarray(seconds, dtype=float), (pieces,))
    h = durations[:, None, None] ** np.arange(4)[:, None] / np.array([1, 7, 42, 210])[:, None]  # (pieces, 4, 1)
    a, b = np.moveaxis(knots[:-1] * h, 1, 0), np.moveaxis(knots[1:] * h, 1, 0)  # (4, pieces, axis)
    left = [a[0], a[0] + a[1], a[0] + 2 * a[1] + a[2], a[0] + 3 * a[1] + 3 * a[2] + a[3]]
    right = [b[0] - 3 * b[1] + 3 * b[2] - b[3], b[0] - 2 * b[1] + b[2], b[0] - b[1], b[0]]
    points = np.stack([*left, *right], axis=-1)
    points[:, 2] = 0.6
    points[:, 3] = 0.0
    return PiecewisePolynomial(durations, power_coefficients(points, durations))


# ---------------------------------------------------------------------------------------------------- poly4d


@given(trajectories())
def test_poly4d_keeps_the_nearest_float32(trajectory):
    data = encode_poly4d(trajectory)
    again = decode_poly4d(data, trajectory.pieces)
    assert len(data) == trajectory.pieces * PIECE_SIZE
    with np.errstate(under="ignore"):
        np.testing.assert_array_equal(again.coefficients, trajectory.coefficients.astype(np.float32))
        np.testing.assert_array_equal(again.durations, trajectory.durations.astype(np.float32))
    assert encode_poly4d(again) == data


def test_poly4d_layout():
    coefficients = np.arange(32.0).reshape(1, 4, 8)
    data = encode_poly4d(PiecewisePolynomial(np.array([2.5]), coefficients))
    np.testing.assert_array_equal(np.frombuffer(data, "<f4"), [*range(32), 2.5])


@pytest.mark.parametrize(
    ("durations", "value", "reason"),
    [(np.ones(32), 0.0, "32 pieces need 4224 bytes"), (np.ones(1), 1e39, "float32"), (np.full(1, 1e-50), 0.0, "lasts")],
)
def test_poly4d_refuses_what_it_cannot_hold(durations, value, reason):
    trajectory = PiecewisePolynomial(durations, np.full((len(durations), 4, 8), value))
    with pytest.raises(TrajectoryError, match=reason):
        encode_poly4d(trajectory)


@given(st.binary(max_size=3 * PIECE_SIZE), st.integers(-1, 40))
def test_poly4d_garbage_is_refused_or_flies_as_said(data, pieces):
    try:
        trajectory = decode_poly4d(data, pieces)
    except TrajectoryError:
        return
    assert encode_poly4d(trajectory) == data


# ------------------------------------------------------------------------------------------------ compressed


@given(trajectories(most=20, reach=3.0))
def test_compressed_is_within_its_grid(trajectory):
    """Every given control point is at most a few millimetres away; ends are rounded to the nearest one."""
    decoded = decode_compressed(encode_compressed(trajectory), trajectory.pieces)
    given_points = control_points(trajectory.coefficients, trajectory.durations)
    got = control_points(decoded.coefficients, decoded.durations)
    grid = np.array([1e-3, 1e-3, 1e-3, math.radians(0.1)])[:, None]
    assert (np.abs(got - given_points)[..., -1:] <= 0.5 * grid + SINGLE).all()
    assert (np.abs(got - given_points)[..., 1:] <= 5.5 * grid + SINGLE).all()
    np.testing.assert_allclose(got[1:, :, 0], got[:-1, :, 7], atol=SINGLE)  # never a gap
    np.testing.assert_allclose(decoded.durations, trajectory.durations, atol=1e-9)


@given(trajectories(most=20, reach=3.0))
def test_compressing_again_changes_nothing_when_pieces_join(trajectory):
    once = decode_compressed(encode_compressed(trajectory), trajectory.pieces)
    twice = decode_compressed(encode_compressed(once), once.pieces)
    ends = [control_points(p.coefficients, p.durations)[..., -1] for p in (once, twice)]
    np.testing.assert_allclose(ends[0], ends[1], atol=SINGLE)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("seconds", [0.9, [0.8, 0.9, 1.1, 1.0, 0.8, 1.0]])
def test_compressed_curves_stay_smooth(seed, seconds):
    """Continuing derivatives instead of rounding each point keeps jumps small, and rest stays rest."""
    given_curve = smooth(seed=seed, seconds=seconds)
    curve = decode(encode(given_curve, COMPRESSED))
    t = np.linspace(0, given_curve.duration, 2001)
    assert np.abs(curve.evaluate(t) - given_curve.evaluate(t)).max() < 3e-3
    points = control_points(curve.coefficients, curve.durations)
    h = curve.durations[:, None, None]
    velocity = 7 / h * np.diff(points, axis=-1)
    acceleration = 42 / h**2 * np.diff(points, n=2, axis=-1)
    assert np.abs(velocity[1:, :, 0] - velocity[:-1, :, -1]).max() < 0.5e-3 * 7 / h.min() + 5e-4
    assert np.abs(acceleration[1:, :, 0] - acceleration[:-1, :, -1]).max() < 0.5e-3 * 42 / h.min() ** 2 + 5e-3
    assert np.abs(velocity[0, :, 0]).max() < 1e-9
    assert np.abs(acceleration[-1, :, -1]).max() < 5e-3  # single precision


def test_compressed_spends_no_bytes_on_what_stands_still():
    encoded = encode(smooth(pieces=6), COMPRESSED).legs[0]
    assert len(encoded.data) == 8 + 6 * (3 + 2 * 14) + 3
    assert encoded.data.endswith(END_MARKER)


def test_compressed_uses_the_lowest_degree():
    durations = np.array([2.0, 1.0, 1.0])
    coefficients = np.zeros((3, 4, 8))
    coefficients[0, 0, :2] = 1.0, 0.25  # a line
    coefficients[1:, 0, 0] = 1.5
    coefficients[:, 1, 0] = 0.5
    coefficients[1, 1, 2:4] = 3.0, -2.0  # a cubic from 0.5 to 1.5
    coefficients[2, 1, 0] = 1.5
    data = encode_compressed(PiecewisePolynomial(durations, coefficients))
    assert len(data) == 8 + (3 + 2) + (3 + 6) + 3 + 3
    np.testing.assert_allclose(decode_compressed(data, 3).coefficients, coefficients, atol=1e-6)


def test_compressed_rounds_joint_times_not_durations():
    trajectory = PiecewisePolynomial(np.full(100, 0.1004), np.zeros((100, 4, 8)))
    decoded = decode_compressed(encode_compressed(trajectory), 100)
    np.testing.assert_allclose(decoded.knots(), trajectory.knots(), atol=0.5e-3 + 1e-9)


@pytest.mark.parametrize(
    ("duration", "position", "reason"),
    [(1.0, 32.768, "32.767"), (1.0, -33.0, "32.767"), (65.6, 0.0, "65.535"), (0.0004, 0.0, "0.001")],
)
def test_compressed_refuses_what_it_cannot_hold(duration, position, reason):
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, 1, 0] = position
    with pytest.raises(TrajectoryError, match=reason):
        encode_compressed(PiecewisePolynomial(np.array([duration]), coefficients))


def test_compressed_refuses_more_than_the_memory():
    with pytest.raises(TrajectoryError, match="4096"):
        encode_compressed(smooth(pieces=140))


@given(st.binary(max_size=80), st.integers(-1, 5))
def test_compressed_garbage_is_refused_or_flies_as_said(data, pieces):
    try:
        trajectory = decode_compressed(data, pieces)
    except TrajectoryError:
        return
    assert trajectory.pieces == pieces


@given(trajectories(most=3), st.data())
def test_cut_or_lengthened_bytes_are_refused(trajectory, data):
    for settings in (TrajectorySettings(encoding="poly4d"), COMPRESSED):
        encoded = encode(trajectory, settings)
        held = encoded.legs[0].data
        cut = data.draw(st.integers(0, len(held) - 1))
        for wrong in (held[:cut], held + b"\0\0\0"):
            with pytest.raises(TrajectoryError):
                decode(altered(encoded, data=wrong))
        with pytest.raises(TrajectoryError):
            decode(altered(encoded, pieces=encoded.pieces + 1))


def test_compressed_rounding_makes_good_what_it_does():
    """The acceleration of smooth curves is shaken less than by rounding every control point on its own."""
    shaken, naive = [], []
    for seed in range(10):
        given_curve = smooth(seed=seed, seconds=0.8)
        t = np.linspace(0, given_curve.duration, 2001)
        asked = given_curve.evaluate(t, 2)
        points = control_points(given_curve.coefficients, given_curve.durations)
        nearest = PiecewisePolynomial(
            given_curve.durations, power_coefficients(np.rint(points * 1e3) / 1e3, given_curve.durations)
        )
        shaken.append(np.abs(decode(encode(given_curve, COMPRESSED)).evaluate(t, 2) - asked).max())
        naive.append(np.abs(nearest.evaluate(t, 2) - asked).max())
    assert np.mean(shaken) < 0.85 * np.mean(naive)


# ------------------------------------------------------------------------------------------------ the choice


def test_auto_prefers_float32_while_it_fits():
    short, long = encode(smooth(pieces=31)), encode(smooth(pieces=32))
    assert (short.legs[0].encoding, long.legs[0].encoding) == (Encoding.POLY4D, Encoding.COMPRESSED)
    assert "31 pieces, 4092 of 4096 bytes" in short.reason
    assert "more than the 31 pieces" in long.reason


def test_the_hash_covers_bytes_pieces_and_encoding_but_not_words():
    one = encode(smooth())
    (leg,) = one.legs
    assert one.sha256 == altered(one, reason="other words").sha256
    cut = len(leg.data) // 2
    others = [
        altered(one, encoding=Encoding.COMPRESSED),
        altered(one, pieces=leg.pieces + 1),
        altered(one, offset=2048),
        altered(one, data=bytes([leg.data[0] ^ 1]) + leg.data[1:]),
        EncodedTrajectory((leg, leg)),
        EncodedTrajectory((leg, Leg(leg.encoding, leg.data[:cut], leg.pieces))),
        EncodedTrajectory((Leg(leg.encoding, leg.data[:cut], leg.pieces), leg)),
    ]
    assert len({one.sha256, *(other.sha256 for other in others)}) == len(others) + 1
    assert one.memory == one.size == len(leg.data) <= MEMORY_SIZE
    with pytest.raises(ValueError, match="at least one leg"):
        EncodedTrajectory(())
