"""Whether the bytes fit the drone and last as long as the mission."""

from __future__ import annotations

import numpy as np

from planner.certificate.record import Check
from planner.trajectory.bezier import control_points
from planner.trajectory.encode import decode
from planner.trajectory.encoded import MEMORY_SIZE, EncodedTrajectory, Encoding
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.trajectory.poly4d import MAX_PIECES

DURATION_TOLERANCE = 1e-3  # [s]

_FARTHEST = 1e4  # [m]; beyond it the numbers are garbage and squares of them may overflow
_LONGEST = 1e5  # [s]


def decoded(name: str, encoded: EncodedTrajectory) -> PiecewisePolynomial:
    """Decode a robot's bytes; the decoder checks lengths, finite numbers, positive durations and the end marker.

    Raises:
        TrajectoryError: the bytes are no trajectory, or one that no drone could mean; names the robot.
    """
    try:
        trajectory = decode(encoded)
    except TrajectoryError as error:
        raise TrajectoryError(f"robot {name}: {error}") from None
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        reach = float(np.abs(control_points(trajectory.coefficients, trajectory.durations)).max())
    if not (trajectory.duration <= _LONGEST and reach <= _FARTHEST):
        raise TrajectoryError(
            f"robot {name}: the bytes reach {reach:.3g} m in {trajectory.duration:.3g} s: no drone's trajectory "
            f"(allowed are {_FARTHEST:g} m and {_LONGEST:g} s)"
        )
    return trajectory


def memory_checks(name: str, encoded: EncodedTrajectory, duration: float, horizon: float) -> list[Check]:
    """Bytes, pieces and duration against memory and mission."""
    checks = [
        Check("memory", encoded.memory, MEMORY_SIZE, "bytes", "<=", encoded.memory <= MEMORY_SIZE, name),
        Check(
            "duration",
            abs(duration - horizon),
            0.0,
            "s",
            "<=",
            abs(duration - horizon) <= DURATION_TOLERANCE,
            name,
            tolerance=DURATION_TOLERANCE,
        ),
    ]
    for leg in encoded.legs:
        if leg.encoding is Encoding.POLY4D:
            checks.append(Check("pieces", leg.pieces, MAX_PIECES, "", "<=", leg.pieces <= MAX_PIECES, name))
    return checks
