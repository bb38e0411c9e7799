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


def from_csv(text: str, name: str = "trajectory CSV") -> PiecewisePolynomial:
    """Read CSV text: the first line is the header, columns beyond the 33rd are not allowed unless empty.

    Args:
        text: the file's text.
        name: what to call the file in messages.

    Raises:
        TrajectoryError: no header, no pieces, a wrong number of columns, something that is no finite number, a
            duration <= 0.
    """
    lines = text.splitlines()
    if lines and is_number(lines[0].split(",")[0]):  # whoever skips the first line would lose a piece
        raise TrajectoryError(f"{name}, line 1: a number; expected a header line such as '{HEADER[:22]},…'")
    rows = [_row(line, f"{name}, line {k}") for k, line in enumerate(lines[1:], start=2) if line.strip(" ,\t")]
    if not rows:
        raise TrajectoryError(f"{name}: no pieces; expected a header line and one line of 33 numbers a piece")
    numbers = np.array(rows)
    return PiecewisePolynomial(durations=numbers[:, 0], coefficients=numbers[:, 1:].reshape(len(rows), 4, 8))


def cells_of(line: str, least: int = 1) -> list[str]:
    """The cells of a line, stripped; published files end their lines with commas: empty cells beyond ``least`` go."""
    cells = [cell.strip() for cell in line.split(",")]
    while len(cells) > least and not cells[-1]:
        cells.pop()
    return cells


def is_number(cell: str) -> bool:
    """Whether a cell is a number: a header's are not."""
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _row(line: str, where: str) -> list[float]:
    """The 33 numbers of one line."""
    cells = cells_of(line, _COLUMNS)
    if len(cells) != _COLUMNS:
        raise TrajectoryError(f"{where}: {len(cells)} columns; {_COLUMNS} expected")
    try:
        row = [float(cell) for cell in cells]
    except ValueError as error:
        raise TrajectoryError(f"{where}: {error}") from None
    if not np.isfinite(row).all():
        raise TrajectoryError(f"{where}: numbers must be finite")
    if row[0] <= 0:
        raise TrajectoryError(f"{where}: duration {row[0]:g} s; it must be positive")
    return row
