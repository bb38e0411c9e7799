"""The setpoints of all drones as arrays, the form the controllers compute with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from deploy.radio.simulated.interface import Setpoint, SetpointMode

MODES = tuple(SetpointMode)
OFF, FULL, POSITION, VELOCITY, HOVER, ATTITUDE, HEIGHT, CLIMB, RATES = range(len(MODES))
_CODE = {mode: code for code, mode in enumerate(MODES)}


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
        self._held: list[Setpoint] = [Setpoint()] * n
        self.position, self.velocity = self._block[:, 0:3], self._block[:, 3:6]
        self.acceleration, self.omega = self._block[:, 6:9], self._block[:, 9:12]
        self.attitude, self.yaw, self.thrust = self._block[:, 12:14], self._block[:, 14], self._block[:, 15]
        self._classify()

    def take(self, setpoints: Sequence[Setpoint]) -> None:
        """Take the setpoints of all drones; those that are the records of the last tick cost nothing."""
        held = self._held
        changed = [i for i, setpoint in enumerate(setpoints) if setpoint is not held[i]]
        if not changed:
            return
        rows = [_row(setpoints[i]) for i in changed]
        if len(changed) == len(held):
            self._block[:] = rows
        else:
            self._block[changed] = rows
        if any(setpoints[i].mode is not held[i].mode for i in changed):
            self.mode[:] = [_CODE[setpoint.mode] for setpoint in setpoints]
            self._classify()
        self._held = list(setpoints)

    def _classify(self) -> None:
        mode = self.mode
        self.by_position = (mode == FULL) | (mode == POSITION)
        self.by_height = self.by_position | (mode == HOVER) | (mode == HEIGHT)
        self.attitude_only, self.rates = mode == ATTITUDE, mode == RATES
        self.manual, self.active = self.attitude_only | self.rates, mode != OFF
        self.leaning = self.manual | (mode == HEIGHT) | (mode == CLIMB)
        self.all_by_position, self.any_manual = bool(self.by_position.all()), bool(self.manual.any())
        self.any_rates = bool(self.rates.any())


def _row(s: Setpoint) -> tuple[float, ...]:
    return (*s.position, *s.velocity, *s.acceleration, *s.omega, *s.attitude, s.yaw, s.thrust)
