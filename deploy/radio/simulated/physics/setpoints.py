"""The setpoints of all drones as arrays, the form the controllers compute with."""

from __future__ import annotations

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
        self._held: list[Setpoint] = [Setpoint()] * n
        self.position, self.velocity = self._block[:, 0:3], self._block[:, 3:6]
        self.acceleration, self.omega = self._block[:, 6:9], self._block[:, 9:12]
        self.attitude, self.yaw, self.thrust = self._block[:, 12:14], self._block[:, 14], self._block[:, 15]
        self._classify()

    def put(self, index: int, setpoint: Setpoint) -> None:
        """Take one drone's setpoint; nothing to do when it is the record of the last tick."""
        if setpoint is self._held[index]:
            return
        before, self._held[index] = self._held[index], setpoint
        s = setpoint
        self._block[index] = (*s.position, *s.velocity, *s.acceleration, *s.omega, *s.attitude, s.yaw, s.thrust)
        if s.mode is not before.mode:
            self.mode[index] = _CODE[s.mode]
            self._classify()
        if s.mode is SetpointMode.FULL:
            self.ahead[index] = self._block[index, 3:12]
        else:
            self.ahead[index] = 0.0
            self.ahead[index, 8] = s.omega[2] if s.mode is SetpointMode.ATTITUDE else 0.0

    def _classify(self) -> None:
        mode = self.mode
        self.by_position = (mode == FULL) | (mode == POSITION)
        self.manual, self.active = mode == ATTITUDE, mode != OFF
        self.all_by_position, self.any_manual = bool(self.by_position.all()), bool(self.manual.any())
