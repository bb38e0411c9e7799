"""Trajectories longer than the memory: legs that lie in alternating halves of it, one flown, the other written.

The firmware evaluates pieces in place, also the last one after its end, so the half that flies is never written. Legs
are cut at joints of the polynomial, whose bytes stay what they are: a chain of legs decodes to the trajectory that was
encoded, to the last bit. Which joints is a shortest path: every switch costs the square of the speed it is flown at,
because a start command that comes too early or too late makes the setpoint jump by that speed times the time, and one
fast switch is worse than two slow ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from missions.arrays import Array
from planner.trajectory.compressed import LEG_OVERHEAD, compressed_leg, compressed_segments
from planner.trajectory.encoded import MEMORY_SIZE, EncodedTrajectory, Encoding, Leg
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.piecewise import PiecewisePolynomial, concatenated
from planner.trajectory.poly4d import MAX_PIECES, PIECE_SIZE, encode_pieces, encode_poly4d

HALF = MEMORY_SIZE // 2
QUARTER = HALF // 2  # of a mission that may be planned anew: two versions of a leg lie in one half
CALM = 0.1  # [m/s]; a switch at this speed costs as much as one more switch
SHORTEST_LEG = 8.0  # [s] legs are no shorter if they can: while one flies the next is uploaded
_HURRY = 80.0  # what a leg of no length costs; shorter ones in proportion to what they lack


def poly4d_legs(trajectory: PiecewisePolynomial) -> tuple[Leg, ...]:
    """One leg if all pieces fit the memory, else legs of at most 15. Raises TrajectoryError: :func:`encode_poly4d`."""
    if trajectory.pieces <= MAX_PIECES:
        return (Leg(Encoding.POLY4D, encode_poly4d(trajectory), trajectory.pieces),)
    data = encode_pieces(trajectory)
    pieces = [data[at : at + PIECE_SIZE] for at in range(0, len(data), PIECE_SIZE)]
    rounded = PiecewisePolynomial(trajectory.durations.astype("<f4"), trajectory.coefficients.astype("<f4"))
    cuts = choose_joints(rounded, np.full(len(pieces), PIECE_SIZE), 0)  # as what is read back would be cut
    return tuple(
        Leg(Encoding.POLY4D, b"".join(pieces[begin:end]), end - begin, offset_of(number))
        for number, (begin, end) in enumerate(pairwise(cuts))
    )


def compressed_legs(trajectory: PiecewisePolynomial) -> tuple[Leg, ...]:
    """One leg if it fits the memory, else legs of at most a half each, rounded as one trajectory.

    Raises:
        TrajectoryError: as :func:`compressed_segments`.
    """
    starts, segments = compressed_segments(trajectory)
    whole = compressed_leg(starts[0], segments)
    if len(whole) <= MEMORY_SIZE:
        return (Leg(Encoding.COMPRESSED, whole, trajectory.pieces),)
    cuts = choose_joints(trajectory, np.array([len(segment) for segment in segments]), LEG_OVERHEAD)
    return tuple(
        Leg(Encoding.COMPRESSED, compressed_leg(starts[begin], segments[begin:end]), end - begin, offset_of(number))
        for number, (begin, end) in enumerate(pairwise(cuts))
    )


def legs_between(
    trajectory: PiecewisePolynomial, joints: Sequence[float], before: PiecewisePolynomial | None = None, first: int = 0
) -> tuple[Leg, ...]:
    """Compressed legs that are cut at given joints, each no longer than a quarter of the memory.

    Args:
        trajectory: with a piece that ends at each joint.
        joints: when, after its start [s].
        before: what is flown before it, as the drone flies it; the first leg goes on from there, rounding and all.
        first: number of the first leg. Of a trajectory that takes over (``before``) it lies in the second quarter of
            its half: beside the leg that it may replace.

    Raises:
        TrajectoryError: as :func:`compressed_segments`; no piece ends at a joint; a leg is too long.
    """
    lead = 0
    if before is not None:
        last = PiecewisePolynomial(before.durations[-1:], before.coefficients[-1:])
        trajectory, lead = concatenated([last, trajectory]), 1
    starts, segments = compressed_segments(trajectory)
    knots = trajectory.knots() - trajectory.knots()[lead]
    cuts = [lead, *(int(np.abs(knots - joint).argmin()) for joint in joints), trajectory.pieces]
    legs = []
    for number, (begin, end) in enumerate(pairwise(cuts), start=first):
        replaces = before is not None and number == first
        leg = Leg(
            Encoding.COMPRESSED,
            compressed_leg(starts[begin], segments[begin:end]),
            end - begin,
            offset_of(number) + QUARTER * replaces,
        )
        if len(leg.data) > QUARTER:
            raise TrajectoryError(
                f"leg {number + 1} has {len(leg.data)} bytes; between joints {QUARTER} are allowed, for two versions "
                "of it have to lie in half of the memory (more joints make legs shorter)"
            )
        legs.append(leg)
    if joints and max(abs(float(knots[cut]) - joint) for cut, joint in zip(cuts[1:-1], joints, strict=True)) > 1e-3:
        raise TrajectoryError(f"no piece ends at a joint; joints are at {', '.join(f'{t:g}' for t in joints)} s")
    return tuple(legs)


def offset_of(number: int) -> int:
    """Where leg ``number`` (from 0) of a chain lies in the memory."""
    return HALF * (number % 2)


def choose_joints(trajectory: PiecewisePolynomial, sizes: Array | np.ndarray, overhead: int) -> list[int]:
    """First pieces of the legs, and the number of pieces: the cheapest cut into legs that fit a half.

    Args:
        trajectory: what is cut.
        sizes: (M,) bytes of every piece, each at most a half.
        overhead: bytes every leg needs besides.
    """
    knots, count = trajectory.knots(), trajectory.pieces
    speed = np.linalg.norm(trajectory.coefficients[:, :3, 1], axis=1)  # at the start of every piece
    filled = np.concatenate([[0], np.cumsum(sizes)])
    cost, before = np.full(count + 1, np.inf), np.zeros(count + 1, dtype=int)
    cost[0] = 0.0
    for end in range(1, count + 1):
        begin = np.arange(np.searchsorted(filled, filled[end] + overhead - HALF), end)
        hurry = _HURRY * np.maximum(1.0 - (knots[end] - knots[begin]) / SHORTEST_LEG, 0.0)
        switch = 1.0 + (speed[end] / CALM) ** 2 if end < count else 0.0
        total = cost[begin] + hurry + switch
        best = int(np.argmin(total))
        cost[end], before[end] = total[best], begin[best]
    cuts = [count]
    while cuts[-1]:
        cuts.append(int(before[cuts[-1]]))
    return cuts[::-1]


def switch_times(durations: Sequence[float]) -> tuple[float, ...]:
    """When legs of these lengths begin, and when the last one ends [s since the start]."""
    return tuple(float(t) for t in np.concatenate([[0.0], np.cumsum(durations)]))


def overlaps(encoded: EncodedTrajectory) -> int:
    """Bytes of the memory, at worst, that a leg shares with the leg before it, which flies while it is written."""
    worst = 0
    for before, leg in pairwise(encoded.legs):
        worst = max(worst, min(before.end, leg.end) - max(before.offset, leg.offset))
    return worst
