"""The setpoints of all drones as arrays, the form the controllers compute with."""

from __future__ import annotations

import numpy as np

from deploy.radio.simulated.interface import PERIOD, Course, Setpoint, SetpointMode

MODES = tuple(SetpointMode)
OFF, FULL, POSITION, VELOCITY, HOVER, ATTITUDE, HEIGHT, CLIMB, RATES = range(len(MODES))
_CODE = {mode: code for code, mode in enumerate(MODES)}
_RING = 64  # ticks that are kept; courses are shorter
# Rows of a course's goals in the table's order; attitude and thrust are not in it.
_GOALS, _COLUMNS = [*range(9), 13, 14, 15, 12], [*range(12), 14]


class SetpointTable:
    """One row a drone; the attributes are views of one block.

    Attributes:
        mode: (N,) code, see the constants of this module.
        position, velocity, acceleration: (N, 3) [m], [m/s], [m/s²], world frame.
        yaw: (N,) [rad]. omega: (N, 3) [rad/s]. attitude: (N, 2) roll, pitch [rad]. thrust: (N,) 0..65535.
        ahead: (N, 9) velocity, acceleration and omega side by side.
        by_position: (N,) x, y, z and yaw are given. by_height: (N,) z is. leaning: (N,) roll and pitch (or their rates)
            are. manual: (N,) thrust is, too. attitude_only: (N,) ATTITUDE. active: (N,) anything but OFF.
        all_by_position, any_manual, any_rates: the same of all drones together; of RATES.
    """

    def __init__(self, n: int) -> None:
        self.mode = np.zeros(n, dtype=np.int64)
        self._block = np.zeros((n, 16))
        self.ahead = self._block[:, 3:12]
        self._ring = np.zeros((_RING, n, 16))
        self._held: list[Setpoint] = [Setpoint()] * n
        self._course: list[Course | None] = [None] * n
        self.position, self.velocity = self._block[:, 0:3], self._block[:, 3:6]
        self.acceleration, self.omega = self._block[:, 6:9], self._block[:, 9:12]
        self.attitude, self.yaw, self.thrust = self._block[:, 12:14], self._block[:, 14], self._block[:, 15]
        self._classify()

    def take(self, i: int, setpoint: Setpoint, course: Course | None) -> None:
        """Take one drone's setpoint from this tick on, or the course that it is part of."""
        if course is self._course[i] and (course is not None or setpoint is self._held[i]):
            return
        if course is None:
            self._ring[:, i] = _row(setpoint)
        else:
            first = round(course.begin / PERIOD)
            ticks = np.arange(first, first + course.goals.shape[1]) % _RING
            self._ring[ticks[:, None], i, _COLUMNS] = course.goals[_GOALS].T
        if setpoint.mode is not self._held[i].mode:
            self.mode[i] = _CODE[setpoint.mode]
            self._stale = True
        self._held[i], self._course[i] = setpoint, course

    def turn(self, tick: int) -> None:
        """It is this tick's turn: ``tick`` periods since the world began."""
        self._block[:] = self._ring[tick % _RING]
        if self._stale:
            self._classify()

    def _classify(self) -> None:
        mode, self._stale = self.mode, False
        self.by_position = (mode == FULL) | (mode == POSITION)
        self.by_height = self.by_position | (mode == HOVER) | (mode == HEIGHT)
        self.attitude_only, self.rates = mode == ATTITUDE, mode == RATES
        self.manual, self.active = self.attitude_only | self.rates, mode != OFF
        self.leaning = self.manual | (mode == HEIGHT) | (mode == CLIMB)
        self.all_by_position, self.any_manual = bool(self.by_position.all()), bool(self.manual.any())
        self.any_rates = bool(self.rates.any())


def _row(s: Setpoint) -> tuple[float, ...]:
    return (*s.position, *s.velocity, *s.acceleration, *s.omega, *s.attitude, s.yaw, s.thrust)
