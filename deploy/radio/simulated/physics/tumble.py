"""When the firmware would say that it lies on its side or upside down (supervisor.c, isTumbledCheck)."""

from __future__ import annotations

import numpy as np

from deploy.radio.simulated.physics.algebra import GRAVITY, Flags
from missions.arrays import Array

_TILTED, _TILTED_FOR = 0.5 * GRAVITY, 1.0  # body z specific force below this [m/s²], for so long [s]
_OVERTURNED, _OVERTURNED_FOR = -0.2 * GRAVITY, 0.1
_FREE_FALL = 0.1 * GRAVITY  # every axis below it


class TumbleDetector:
    """Timers of all drones; free fall, which feels like nothing, is no tumbling and starts them again."""

    def __init__(self, n: int) -> None:
        self._tilted = np.zeros(n)
        self._upright, self._nobody = True, np.zeros(n, dtype=np.bool_)

    def update(self, specific_force: Array, dt: float) -> Flags:
        """Take accelerometer readings (N, 3) [m/s²], body frame; returns (N,) bool."""
        z = specific_force[:, 2]
        if self._upright and np.minimum.reduce(z) >= _TILTED:
            return self._nobody
        before = np.where(np.abs(specific_force).max(axis=1) < _FREE_FALL, 0.0, self._tilted)
        self._tilted = np.where(z < _TILTED, before + dt, 0.0)
        # Upside down counts from the start of being tilted, as it does in the firmware.
        overturned = np.where(z < _OVERTURNED, self._tilted, 0.0)
        # Half a tick of slack: a sum of 100 ticks of 10 ms is not exactly one second.
        tumbled: Flags = (self._tilted > _TILTED_FOR - dt / 2) | (overturned > _OVERTURNED_FOR - dt / 2)
        self._upright = not self._tilted.any()
        return tumbled
