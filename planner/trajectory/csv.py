"""Trajectory CSV of uav_trajectories, read by Crazyswarm and Crazyswarm2.

One header line, then one line a piece: ``duration``, then eight ascending coefficients of x, y, z [m] and yaw [rad].
Published files end their lines with a comma; that is accepted. Numbers are written with as many digits as float64
needs, so reading back what was decoded from bytes gives the same bytes again.
"""

from __future__ import annotations

import numpy as np

from planner.trajectory.errors import TrajectoryError
from planner.trajectory.piecewise import PiecewisePolynomial

HEADER = ",".join(["duration", *(f"{axis}^{power}" for axis in ("x", "y", "z", "yaw") for power in range(8))])
_COLUMNS = 33


def to_csv(trajectory: PiecewisePolynomial) -> str:
    """Write a trajectory as CSV text."""
    lines = [HEADER]
    for duration, coefficients in zip(trajectory.durations, trajectory.coefficients, strict=True):
        lines.append(",".join(repr(float(number)) for number in (duration, *coefficients.ravel())))
    return "\n".join(lines) + "\n"


def from_csv(text: str) -> PiecewisePolynomial:
    """Read CSV text: the first line is skipped, columns beyond the 33rd are not allowed unless empty.

    Raises:
        TrajectoryError: no pieces, a wrong number of columns, something that is no finite number, a duration <= 0.
    """
    rows = [_row(line, number) for number, line in enumerate(text.splitlines()[1:], start=2) if line.strip(" ,\t")]
    if not rows:
        raise TrajectoryError("trajectory CSV: no pieces; expected a header line and one line of 33 numbers a piece")
    numbers = np.array(rows)
    return PiecewisePolynomial(durations=numbers[:, 0], coefficients=numbers[:, 1:].reshape(len(rows), 4, 8))


def _row(line: str, number: int) -> list[float]:
    """The 33 numbers of one line."""
    cells = [cell.strip() for cell in line.split(",")]
    while len(cells) > _COLUMNS and not cells[-1]:
        cells.pop()
    if len(cells) != _COLUMNS:
        raise TrajectoryError(f"trajectory CSV, line {number}: {len(cells)} columns; {_COLUMNS} expected")
    try:
        row = [float(cell) for cell in cells]
    except ValueError as error:
        raise TrajectoryError(f"trajectory CSV, line {number}: {error}") from None
    if not np.isfinite(row).all():
        raise TrajectoryError(f"trajectory CSV, line {number}: numbers must be finite")
    if row[0] <= 0:
        raise TrajectoryError(f"trajectory CSV, line {number}: duration {row[0]:g} s; it must be positive")
    return row
