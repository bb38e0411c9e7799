"""Stage 5 of 7: polynomials to the bytes of the trajectory memory, and back."""

from __future__ import annotations

from missions.schema import TrajectorySettings
from planner.trajectory.compressed import decode_compressed, encode_compressed
from planner.trajectory.encoded import MEMORY_SIZE, EncodedTrajectory, Encoding, Leg
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.piecewise import PiecewisePolynomial, concatenated
from planner.trajectory.poly4d import MAX_PIECES, decode_poly4d, encode_poly4d

_DEFAULTS = TrajectorySettings()


def encode(trajectory: PiecewisePolynomial, settings: TrajectorySettings = _DEFAULTS) -> EncodedTrajectory:
    """Encode a trajectory in the format the settings ask for.

    ``auto`` takes poly4d when the pieces fit, because float32 keeps micrometres where the compressed format rounds to
    millimetres; the result's ``reason`` says which was taken and why.

    Raises:
        TrajectoryError: it does not fit the format or the memory.
    """
    wanted = settings.encoding
    if wanted == "poly4d" or (wanted == "auto" and trajectory.pieces <= MAX_PIECES):
        data, encoding = encode_poly4d(trajectory), Encoding.POLY4D
        why = "asked for" if wanted == "poly4d" else f"at most {MAX_PIECES} pieces, float32 accuracy"
    else:
        data, encoding = encode_compressed(trajectory), Encoding.COMPRESSED
        why = "asked for" if wanted == "compressed" else f"more than the {MAX_PIECES} pieces poly4d has room for"
    reason = f"{encoding.name.lower()} ({why}): {trajectory.pieces} pieces, {len(data)} of {MEMORY_SIZE} bytes"
    return EncodedTrajectory((Leg(encoding, data, trajectory.pieces, 0, reason),))


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
