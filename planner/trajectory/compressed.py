"""The firmware's compressed trajectory format (crazyflie-firmware ``pptraj_compressed.c``).

8 bytes of start (x, y, z in mm, yaw in 0.1°; int16), then segments, then a segment of zero duration as end marker.
A segment is one byte of types (2 bits an axis: x, y << 2, z << 4, yaw << 6), the duration in ms (uint16), and the
Bézier control points of each axis after the first one: type 0 has none (constant), 1 has 1 (linear), 2 has 3 (cubic),
3 has 7 (degree 7). The first control point is the end of the segment before. The firmware ignores the piece count
and walks until the end marker, so the marker is mandatory here.
"""

from __future__ import annotations

import functools
import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array, frozen
from planner.trajectory.bezier import control_points
from planner.trajectory.encoded import MEMORY_SIZE
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.trajectory.single import coefficients
from planner.trajectory.spline import MU, derivative_points

END_MARKER = b"\0\0\0"
LEG_OVERHEAD = 8 + len(END_MARKER)  # bytes besides segments: where the first one starts, and the marker
LONGEST_PIECE = 65.535  # [s], uint16 ms
FARTHEST = 32.767  # [m], int16 mm

_DEGREES = (0, 1, 3, 7)  # by type
_UNITS = np.array([1e3, 1e3, 1e3, 1800.0 / math.pi])  # integer steps per metre or radian
_LARGEST = 32767
_SMOOTHING = 5  # steps a control point may leave its nearest integer to keep velocity and acceleration continuous
_SAME = 1e-3  # steps between control points of a rest


def encode_compressed(trajectory: PiecewisePolynomial) -> bytes:
    """Encode a trajectory, end marker included; rounding is part of the model.

    Joint times are rounded to 1 ms (not durations: their errors would add up). A segment starts at the integers where
    the one before ended, its next two control points are the integers that continue velocity and acceleration best,
    and the others make good what was rounded before them: a 1 mm grid would otherwise shake the acceleration.

    Raises:
        TrajectoryError: coordinates beyond ±32.767 m or yaw beyond ±3276.7°, a piece shorter than 1 ms or longer
            than 65.535 s, more than 4096 bytes.
    """
    starts, segments = compressed_segments(trajectory)
    data = compressed_leg(starts[0], segments)
    if len(data) > MEMORY_SIZE:
        raise TrajectoryError(f"compressed: {len(data)} bytes; the trajectory memory holds {MEMORY_SIZE}")
    return data


def compressed_segments(trajectory: PiecewisePolynomial) -> tuple[list[tuple[int, ...]], list[bytes]]:
    """The integers x, y, z, yaw that every segment starts at, and the segments' bytes; however many they are.

    Raises:
        TrajectoryError: as :func:`encode_compressed`, but for the size.
    """
    milliseconds = np.diff(np.rint(trajectory.knots() * 1e3))
    if (milliseconds < 1).any() or (milliseconds > 0xFFFF).any():
        worst = float(trajectory.durations[np.argmax((milliseconds < 1) | (milliseconds > 0xFFFF))])
        raise TrajectoryError(f"compressed: a piece lasts {worst:g} s; allowed are 0.001 to {LONGEST_PIECE} s")
    ideal = control_points(trajectory.coefficients, trajectory.durations) * _UNITS[:, None]  # (M, 4, 8) [steps]
    if not (np.abs(ideal) <= _LARGEST).all():
        worst = float(np.max(np.abs(ideal / _UNITS[:, None])))
        raise TrajectoryError(
            f"compressed: a control point at {worst:g} m or rad; allowed are ±{FARTHEST} m and ±3276.7°"
        )
    axes = [_round_axis(ideal[:, axis], milliseconds) for axis in range(4)]
    starts, segments = [], []
    for piece, duration in enumerate(milliseconds):
        curves = [axis[piece] for axis in axes]
        types = sum(_DEGREES.index(len(curve) - 1) << (2 * axis) for axis, curve in enumerate(curves))
        points = [int(point) for curve in curves for point in curve[1:]]
        starts.append(tuple(int(curve[0]) for curve in curves))
        segments.append(struct.pack(f"<BH{len(points)}h", types, int(duration), *points))
    return starts, segments


def compressed_leg(start: Sequence[int], segments: Sequence[bytes]) -> bytes:
    """The bytes of segments that follow one another from a start, end marker included."""
    return b"".join([struct.pack("<4h", *start), *segments, END_MARKER])


def decode_compressed(data: bytes, pieces: int) -> PiecewisePolynomial:
    """Decode ``pieces`` segments as the firmware does.

    Raises:
        TrajectoryError: cut data, a missing end marker, bytes behind it, another number of segments than ``pieces``.
    """
    if len(data) > MEMORY_SIZE:
        raise TrajectoryError(f"compressed: {len(data)} bytes; the trajectory memory holds {MEMORY_SIZE}")
    segments = _parse(data)
    if len(segments) != pieces or not segments:
        raise TrajectoryError(f"compressed: {len(segments)} segments before the end marker; {pieces} expected")
    return _polynomial(segments)


def _polynomial(segments: Sequence[_Segment]) -> PiecewisePolynomial:
    """Integers to metres and seconds, as the firmware computes them."""
    milliseconds = np.array([segment.milliseconds for segment in segments], dtype=np.float64)
    start = [curve[0] for curve in segments[0].curves]
    curves = [[curve[1:] for curve in segment.curves] for segment in segments]
    return PiecewisePolynomial(milliseconds / 1e3, coefficients(start, curves, milliseconds))


@dataclass(frozen=True)
class _Segment:
    """One segment: duration, and per axis all control points, the first included [steps]."""

    milliseconds: int
    curves: tuple[tuple[int, ...], ...]


def _parse(data: bytes) -> list[_Segment]:
    """Walk the bytes up to the end marker, which must be their end."""
    try:
        now = list(struct.unpack_from("<4h", data))
        offset, segments = 8, []
        while True:
            types, milliseconds = struct.unpack_from("<BH", data, offset)
            offset += 3
            if milliseconds == 0:
                break
            curves = []
            for axis in range(4):
                count = _DEGREES[types >> (2 * axis) & 3]
                points = struct.unpack_from(f"<{count}h", data, offset)
                offset += 2 * count
                curves.append((now[axis], *points))
                now[axis] = curves[-1][-1]
            segments.append(_Segment(milliseconds, tuple(curves)))
    except struct.error:
        raise TrajectoryError(f"compressed: cut after {len(data)} bytes, without an end marker") from None
    if offset != len(data) or types:
        raise TrajectoryError(f"compressed: the end marker ends at byte {offset} of {len(data)}, types {types:#x}")
    return segments


def _round_axis(ideal: Array, milliseconds: Array) -> list[Array]:
    """Integer control points of one axis, per piece 1, 2, 4 or 8 of them.

    Args:
        ideal: (M, 8) control points [steps].
        milliseconds: (M,) durations.
    """
    curves: list[Array] = []
    start = np.rint(ideal[0, 0])
    before: Array | None = None  # the 8 control points of the piece before, as encoded
    for m, points in enumerate(ideal):
        curve = _lowest_degree(points, start)
        if curve is None:
            ratio = milliseconds[m] / milliseconds[m - 1]
            curve = _round_septic(points, start, before, ratio, milliseconds[m] / 1e3)
        curves.append(curve)
        before = _elevate(curve)
        start = curve[-1]
    return curves


def _lowest_degree(points: Array, start: float) -> Array | None:
    """Control points of degree 0, 1 or 3 if such a curve is within rounding of the ideal one, else None."""
    for degree in (0, 1, 3):
        low = _reduction(degree) @ points
        low = np.concatenate([[start], np.rint(low[1:])])
        if np.abs(_elevate(low) - points).max() <= 0.5 + 1e-6:
            return low
    return None


@functools.cache
def _elevation(degree: int) -> Array:
    """(8, degree+1) degree elevation to 7."""
    i, j = np.arange(8), np.arange(degree + 1)
    return frozen(
        [
            [math.comb(degree, b) * math.comb(7 - degree, a - b) / math.comb(7, a) if a >= b else 0.0 for b in j]
            for a in i
        ]
    )


@functools.cache
def _reduction(degree: int) -> Array:
    """(degree+1, 8) to the control points of a lower degree: ends interpolated, least squares between."""
    ends = np.zeros((degree + 1, 8))
    ends[0, 0] = 1.0
    if degree:
        ends[-1, -1] = 1.0
    up = _elevation(degree)
    ends[1:-1] = np.linalg.pinv(up[:, 1:-1]) @ (np.eye(8) - up @ ends) if degree > 1 else 0.0
    return frozen(ends)


def _elevate(curve: Array) -> Array:
    """The 8 control points of a curve of lower degree."""
    return _elevation(len(curve) - 1) @ curve


def _round_septic(points: Array, start: float, before: Array | None, ratio: float, seconds: float) -> Array:
    """Round 8 control points one after another, each making good what those before it did to the curve.

    The last one is the integer nearest to it, so that errors do not add up; the second and third continue the
    derivatives of the piece before, if they can; points of a rest at an end stay together. Every other one is the
    integer next to where it would be best, given all that are chosen already and if those behind could still be
    chosen freely (Babai's nearest plane), in the sense of

        ∫ (p − p̂)² + μ² (p̈ − p̈̂)² dt.
    """
    chosen = {0: start, **_rests(points), 7: float(np.rint(points[7]))}
    if before is not None:
        velocity = ratio * (before[7] - before[6])
        acceleration = ratio**2 * (before[7] - 2 * before[6] + before[5])
        second = np.rint(start + velocity)
        third = np.rint(2 * second - start + acceleration)
        if abs(second - points[1]) <= _SMOOTHING:
            chosen[1] = second
            if abs(third - points[2]) <= _SMOOTHING:
                chosen[2] = third
    positions, accelerations = _grams()
    G = positions + (MU / seconds**2) ** 2 * accelerations
    for i in range(1, 8):
        if i not in chosen:
            known = list(chosen)
            free = [k for k in range(8) if k not in chosen]  # begins with i
            error = np.array(list(chosen.values())) - points[known]
            best = points[i] - np.linalg.solve(G[np.ix_(free, free)], G[np.ix_(free, known)] @ error)[0]
            chosen[i] = np.rint(np.clip(best, points[i] - _SMOOTHING, points[i] + _SMOOTHING))
    curve: Array = np.array([chosen[i] for i in range(8)]).clip(-_LARGEST, _LARGEST)
    return curve


def _rests(points: Array) -> dict[int, float]:
    """Integers of control points at an end where the curve rests: equal ones stay equal."""
    chosen = {}
    for end, inward in ((0, 1), (7, -1)):
        same = [end + inward * k for k in range(4) if abs(points[end + inward * k] - points[end]) <= _SAME]
        if same[:3] == [end, end + inward, end + 2 * inward]:  # no velocity, no acceleration
            chosen.update({i: float(np.rint(points[end])) for i in same if i})
    return chosen


@functools.cache
def _grams() -> tuple[Array, Array]:
    """(8, 8) integrals over [0, 1] of products of Bernstein polynomials, and of their second derivatives."""

    def products(n: int) -> Array:
        i, c = range(n + 1), math.comb
        return frozen([[c(n, a) * c(n, b) / c(2 * n, a + b) / (2 * n + 1) for b in i] for a in i])

    second = derivative_points(2)
    return products(7), frozen(second.T @ products(5) @ second)


def rounded(trajectory: PiecewisePolynomial) -> PiecewisePolynomial:
    """What a trajectory becomes in this encoding, in however many legs. Raises TrajectoryError: as the encoder."""
    starts, segments = compressed_segments(trajectory)
    return _polynomial(_parse(compressed_leg(starts[0], segments)))
