"""Waypoint CSV, as the scripts of uav_trajectories read it: ``x,y,z``, ``t,x,y,z`` or ``t,x,y,z,yaw``.

Metres, seconds and radians. A header line is optional; lines may end with a comma. Without times (3 columns) they are
chosen later.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.interchange.errors import InterchangeError
from planner.trajectory.csv import cells_of, is_number

COLUMNS = (("x", "y", "z"), ("t", "x", "y", "z"), ("t", "x", "y", "z", "yaw"))
MOST = 1000  # waypoints: the plan is a dense linear system in all of them
FARTHEST = 1000.0  # [m], [s], [rad]; as workspaces are


@dataclass(frozen=True)
class Waypoints:
    """Where to be, in order.

    Attributes:
        points: (K, 3) x, y, z [m].
        times: (K,) [s], from 0, increasing; None if they are to be chosen.
        yaw: (K,) [rad], continuous; None if it is the mission's.
    """

    points: Array
    times: Array | None = None
    yaw: Array | None = None

    def __post_init__(self) -> None:
        for array in (self.points, self.times, self.yaw):
            if array is not None:
                array.setflags(write=False)


def parse_waypoints(text: str, name: str = "waypoint CSV") -> Waypoints:
    """Read waypoints.

    Args:
        text: the file's text.
        name: what to call it in messages.

    Raises:
        InterchangeError: no waypoint file, with the line.
    """
    lines = [(k, cells_of(line)) for k, line in enumerate(text.splitlines(), start=1) if line.strip(" ,\t")]
    if lines and not is_number(lines[0][1][0]):
        number, header = lines.pop(0)
        if tuple(header) not in COLUMNS:
            allowed = " or ".join(",".join(columns) for columns in COLUMNS)
            raise InterchangeError(f"{name}:{number}: got the header {','.join(header)[:80]!r}; allowed: {allowed}")
        width = len(header)
    else:
        width = len(lines[0][1]) if lines else 0
    if not 2 <= len(lines) <= MOST:
        raise InterchangeError(f"{name}: {len(lines)} waypoints; allowed: 2 to {MOST}")
    rows = np.array([_row(cells, width, f"{name}:{number}") for number, cells in lines])
    numbers = [number for number, _ in lines]
    if width == 3:
        _check_apart(rows, numbers, name)
        return Waypoints(rows)
    _check_times(rows[:, 0], numbers, name)
    return Waypoints(rows[:, 1:4].copy(), rows[:, 0].copy(), rows[:, 4].copy() if width == 5 else None)


def _row(cells: list[str], width: int, where: str) -> list[float]:
    if len(cells) != width or width not in (3, 4, 5):
        raise InterchangeError(f"{where}: {len(cells)} columns; allowed: 3 to 5, the same in every line")
    try:
        row = [float(cell) for cell in cells]
    except ValueError as error:
        raise InterchangeError(f"{where}: {error}") from None
    if not all(abs(value) <= FARTHEST for value in row):
        raise InterchangeError(f"{where}: got {', '.join(cells)[:80]}; allowed: numbers from -1000 to 1000")
    return row


def _check_apart(points: Array, numbers: list[int], name: str) -> None:
    same = np.flatnonzero((np.diff(points, axis=0) == 0.0).all(axis=1))
    if same.size:
        number = numbers[int(same[0]) + 1]
        raise InterchangeError(f"{name}:{number}: the same point as before; allowed: another, or with times (t,x,y,z)")


def _check_times(times: Array, numbers: list[int], name: str) -> None:
    if times[0] != 0.0:
        raise InterchangeError(f"{name}:{numbers[0]}: starts at t = {times[0]:g} s; allowed: 0")
    early = np.flatnonzero(np.diff(times) < 1e-3)
    if early.size:
        k = int(early[0]) + 1
        reason = f"t = {times[k]:g} s after {times[k - 1]:g} s"
        raise InterchangeError(f"{name}:{numbers[k]}: {reason}; allowed: at least a millisecond later")
