"""When the firmware would say that it lies on its side or upside down (supervisor.c, isTumbledCheck)."""

from __future__ import annotations

import numpy as np

from deploy.radio.simulated.physics.algebra import Flags
from missions.arrays import Array

_TILTED, _TILTED_FOR = 0.5, 1.0  # body z specific force below this [g], for so long [s]
_OVERTURNED, _OVERTURNED_FOR = -0.2, 0.1


class TumbleDetector:
    """Timers of all drones."""

    def __init__(self, n: int) -> None:
        self._tilted, self._overturned = np.zeros(n), np.zeros(n)

    def update(self, specific_force_z: Array, dt: float) -> Flags:
        """Take accelerometer readings along body z (N,) [g]; returns (N,) bool."""
        self._tilted = np.where(specific_force_z < _TILTED, self._tilted + dt, 0.0)
        self._overturned = np.where(specific_force_z < _OVERTURNED, self._overturned + dt, 0.0)
        # Half a tick of slack: a sum of 100 ticks of 10 ms is not exactly one second.
        tumbled: Flags = (self._tilted > _TILTED_FOR - dt / 2) | (self._overturned > _OVERTURNED_FOR - dt / 2)
        return tumbled
