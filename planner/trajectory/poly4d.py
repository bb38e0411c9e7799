"""Poly4D, the firmware's uncompressed trajectory format (crazyflie-firmware ``pptraj.h: struct poly4d``).

A piece is 132 bytes, little-endian float32: x[8], y[8], z[8], yaw[8] in ascending powers of the seconds since the
piece's start (metres, radians), then its duration [s]. Nothing separates pieces; how many there are travels in the
``define trajectory`` packet.
"""

from __future__ import annotations

import numpy as np

from planner.trajectory.encoded import MEMORY_SIZE
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.piecewise import PiecewisePolynomial

PIECE_SIZE = 132
MAX_PIECES = MEMORY_SIZE // PIECE_SIZE  # 31

_NUMBERS = PIECE_SIZE // 4  # 4 axes of 8 coefficients, and the duration


def encode_poly4d(trajectory: PiecewisePolynomial) -> bytes:
    """Encode a trajectory; every number is rounded to the nearest float32.

    Raises:
        TrajectoryError: more than 31 pieces, or a number that float32 cannot hold (a duration must stay positive).
    """
    if trajectory.pieces > MAX_PIECES:
        raise TrajectoryError(
            f"poly4d: {trajectory.pieces} pieces need {trajectory.pieces * PIECE_SIZE} bytes; "
            f"the trajectory memory holds {MAX_PIECES} pieces in {MEMORY_SIZE} bytes"
        )
    return encode_pieces(trajectory)


def encode_pieces(trajectory: PiecewisePolynomial) -> bytes:
    """Encode all pieces, whether one memory holds them or not. Raises TrajectoryError: as :func:`encode_poly4d`."""
    numbers = np.concatenate(
        [trajectory.coefficients.reshape(trajectory.pieces, 32), trajectory.durations[:, None]], axis=1
    )
    with np.errstate(over="ignore", under="ignore"):
        rounded = numbers.astype("<f4")
    _check(rounded)
    return rounded.tobytes()


def decode_poly4d(data: bytes, pieces: int) -> PiecewisePolynomial:
    """Decode ``pieces`` pieces; the float32 numbers become float64 unchanged.

    Raises:
        TrajectoryError: wrong length or piece count, a number that is not finite, a duration that is not positive.
    """
    if not 1 <= pieces <= MAX_PIECES:
        raise TrajectoryError(f"poly4d: {pieces} pieces; allowed are 1 to {MAX_PIECES}")
    if len(data) != pieces * PIECE_SIZE:
        raise TrajectoryError(f"poly4d: {len(data)} bytes for {pieces} pieces; {pieces * PIECE_SIZE} expected")
    numbers = np.frombuffer(data, dtype="<f4").reshape(pieces, _NUMBERS)
    _check(numbers)
    wide = numbers.astype(np.float64)
    return PiecewisePolynomial(durations=wide[:, 32], coefficients=wide[:, :32].reshape(pieces, 4, 8))


def _check(numbers: np.ndarray[tuple[int, ...], np.dtype[np.float32]]) -> None:
    """Refuse numbers no firmware could fly."""
    bad = ~np.isfinite(numbers).all(axis=1)
    if bad.any():
        raise TrajectoryError(f"poly4d: piece {int(np.argmax(bad))} holds a number that is no finite float32")
    short = numbers[:, 32] <= 0
    if short.any():
        piece = int(np.argmax(short))
        raise TrajectoryError(f"poly4d: piece {piece} lasts {numbers[piece, 32]:g} s; it must be positive")
