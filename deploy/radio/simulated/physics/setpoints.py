"""The setpoints of all drones as arrays, the form the controllers compute with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from deploy.radio.simulated.interface import Setpoint, SetpointMode

MODES = tuple(SetpointMode)
OFF, FULL, POSITION, VELOCITY, HOVER, ATTITUDE = range(len(MODES))
_CODE = {mode: code for code, mode in enumerate(MODES)}


class SetpointTable:
    """One row a drone; the attributes are views of one block.

    Attributes:
        mode: (N,) code, see the constants of this module.
        position, velocity, acceleration: (N, 3) [m], [m/s], [m/s²], world frame.
        yaw: (N,) [rad]. omega: (N, 3) [rad/s]. attitude: (N, 2) roll, pitch [rad]. thrust: (N,) 0..65535.
        ahead: (N, 9) velocity, acceleration and omega to feed forward: those of FULL, omega's z of ATTITUDE, else zero.
        by_position: (N,) FULL or POSITION. manual: (N,) ATTITUDE. active: (N,) anything but OFF.
        all_by_position, any_manual: the same of all drones together.
    """

    def __init__(self, n: int) -> None:
        self.mode = np.zeros(n, dtype=np.int64)
        self._block = np.zeros((n, 16))
        self.ahead = np.zeros((n, 9))
        self._fed_forward = np.zeros((n, 9), dtype=np.bool_)
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
        np.copyto(self.ahead, 0.0)
        np.copyto(self.ahead, self._block[:, 3:12], where=self._fed_forward)

    def _classify(self) -> None:
        mode = self.mode
        self.by_position = (mode == FULL) | (mode == POSITION)
        self.manual, self.active = mode == ATTITUDE, mode != OFF
        self._fed_forward[:] = (mode == FULL)[:, None]
        self._fed_forward[:, 8] |= self.manual
        self.all_by_position, self.any_manual = bool(self.by_position.all()), bool(self.manual.any())


def _row(s: Setpoint) -> tuple[float, ...]:
    return (*s.position, *s.velocity, *s.acceleration, *s.omega, *s.attitude, s.yaw, s.thrust)
