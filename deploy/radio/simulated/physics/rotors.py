"""Four rotors a drone: how commands become thrust, and thrust becomes acceleration.

Thrust is a fraction of the motor's greatest thrust and proportional to its 16-bit command, because the firmware
compensates the battery's voltage (motors.c, motorsCompensateBatteryVoltage): taken as ideal as long as the battery can
deliver. Motors spin up faster than they spin down; both are first-order lags.

Motors as numbered on the airframe: 1 front right, 2 back right, 3 back left, 4 front left; 1 and 3 turn
counter-clockwise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from missions.airframes import Airframe
from missions.arrays import Array, frozen

COMMAND_MAX = 65535.0
ROLL = (-1.0, -1.0, 1.0, 1.0)  # sign of every motor's torque about body x (forward), y (left), z (up)
PITCH = (-1.0, 1.0, 1.0, -1.0)
YAW = (-1.0, 1.0, -1.0, 1.0)
_WRENCH = frozen(np.array([(1.0, 1.0, 1.0, 1.0), ROLL, PITCH, YAW]).T)  # (4 motors, 4 sums)


class Rotors:
    """Thrust state of all rotors.

    Attributes:
        thrust: (N, 4) present thrust as a fraction of the greatest.
        health: (N, 4) what a motor still delivers, 1 sound .. 0 broken; a fault scenario writes it.
    """

    def __init__(self, airframes: Sequence[Airframe], dt: float) -> None:
        n = len(airframes)
        self.thrust = np.zeros((n, 4))
        self.health = np.ones((n, 4))
        self._ceiling = np.ones((n, 4))
        # Exact discretisation of the lag for a command held during dt.
        self._gap, self._rise = np.zeros((n, 4)), np.zeros((n, 4))
        self._accelerations = np.zeros((n, 4))
        self._up = np.array([[1.0 - np.exp(-dt / a.motor_tau_up)] for a in airframes])
        self._down = np.array([[1.0 - np.exp(-dt / a.motor_tau_down)] for a in airframes])
        self._scale = np.array([_accelerations(a) for a in airframes])

    def limit(self, available: Array) -> None:
        """Set the share (N,) of the greatest thrust that the battery allows."""
        self._ceiling = self.health * available[:, None]

    def step(self, command: Array) -> None:
        """Follow commands (N, 4), 0..65535, for one dt."""
        gap, rise = self._gap, self._rise
        np.multiply(command, 1.0 / COMMAND_MAX, out=gap)
        np.minimum(gap, self._ceiling, out=gap)
        gap -= self.thrust
        # Rising needs the larger of the two steps, falling the one nearer to zero: with up >= down both are maxima.
        np.multiply(self._up, gap, out=rise)
        gap *= self._down
        self.thrust += np.maximum(rise, gap, out=rise)

    def accelerations(self) -> Array:
        """(N, 4): specific thrust along body z [m/s²] and angular accelerations about body x, y, z [rad/s²].

        The array is the same one at every call.
        """
        out = self._accelerations
        np.dot(self.thrust, _WRENCH, out=out)
        out *= self._scale
        return out


def _accelerations(airframe: Airframe) -> tuple[float, float, float, float]:
    force = airframe.motor_thrust_max
    lever = force * airframe.arm / np.sqrt(2.0)  # X configuration: both axes see the arm at 45 degrees
    jx, jy, jz = airframe.inertia
    return force / airframe.mass, lever / jx, lever / jy, force * airframe.torque_per_thrust / jz
