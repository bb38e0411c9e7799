"""Stage 5 of 7: polynomials to the bytes of the trajectory memory, and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from missions.schema import TrajectorySettings
from planner.trajectory.compressed import decode_compressed
from planner.trajectory.encoded import MEMORY_SIZE, EncodedTrajectory, Encoding, Leg
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.legs import HALF, compressed_legs, legs_between, poly4d_legs
from planner.trajectory.piecewise import PiecewisePolynomial, concatenated
from planner.trajectory.poly4d import MAX_PIECES, decode_poly4d

_DEFAULTS = TrajectorySettings()


def encode(
    trajectory: PiecewisePolynomial, settings: TrajectorySettings = _DEFAULTS, joints: Sequence[float] = ()
) -> EncodedTrajectory:
    """Encode a trajectory in the format the settings ask for, as one leg if the memory holds it.

    ``auto`` takes poly4d when the pieces fit, because float32 keeps micrometres where the compressed format rounds to
    millimetres; the result's ``reason`` says which was taken and why. What no memory holds becomes a chain of legs
    that are uploaded in flight; ``auto`` compresses them, for the fewest switches. With ``joints`` [s], at which
    pieces have to end, it is a chain of legs from one to the next.

    Raises:
        TrajectoryError: it does not fit the format.
    """
    wanted = settings.encoding
    if joints:
        legs = legs_between(trajectory, joints)
        why = "two versions of a leg have to fit half of the memory"
    elif wanted == "poly4d" or (wanted == "auto" and trajectory.pieces <= MAX_PIECES):
        legs = poly4d_legs(trajectory)
        why = "asked for" if wanted == "poly4d" else f"at most {MAX_PIECES} pieces, float32 accuracy"
    else:
        legs = compressed_legs(trajectory)
        why = "asked for" if wanted == "compressed" else f"more than the {MAX_PIECES} pieces poly4d has room for"
    size = sum(len(leg.data) for leg in legs)
    room = f"of {MEMORY_SIZE} bytes" if len(legs) == 1 else f"bytes in {len(legs)} legs of at most {HALF}"
    reason = f"{legs[0].encoding.name.lower()} ({why}): {trajectory.pieces} pieces, {size} {room}"
    return EncodedTrajectory(tuple(replace(leg, reason=reason) for leg in legs))


def decode(encoded: EncodedTrajectory) -> PiecewisePolynomial:
    """What the firmware will fly, leg after leg without a pause, from the bytes alone.

    Raises:
        TrajectoryError: the bytes of a leg are no trajectory of its format and piece count.
    """
    return concatenated([decode_leg(leg) for leg in encoded.legs])


def decode_leg(leg: Leg) -> PiecewisePolynomial:
    """What the firmware will fly of one leg, from the bytes alone. Raises TrajectoryError."""
    if leg.encoding is Encoding.POLY4D:
        return decode_poly4d(leg.data, leg.pieces)
    if leg.encoding is Encoding.COMPRESSED:
        return decode_compressed(leg.data, leg.pieces)
    raise TrajectoryError(f"unknown encoding {leg.encoding!r}; known: {', '.join(e.name for e in Encoding)}")
