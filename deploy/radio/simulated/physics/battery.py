"""One LiPo cell a drone: voltage sags with the load, charge runs out.

Open-circuit voltage over state of charge has the usual LiPo shape between the airframe's full and empty voltages;
under load it drops over the internal resistance. Rotors draw power like thrust^1.5 (momentum theory), scaled to the
airframe's power in hover. Below the voltage at which the motors' greatest thrust was specified, that thrust falls with
the square of the voltage. An empty cell is cut off by its protection and gives nothing any more. Idealised:
temperature, ageing, and the recovery of a resting cell are left out.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from deploy.radio.simulated.physics.algebra import GRAVITY
from missions.airframes import Airframe
from missions.arrays import Array

_CHARGE = (0.0, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0)
_SHAPE = (0.0, 0.375, 0.5, 0.583, 0.65, 0.725, 0.833, 1.0)  # typical LiPo discharge curve at low current
_ELECTRONICS = 0.9  # [W] 0.24 A at 3.7 V: a Crazyflie with its motors off (Bitcraze wiki, investigations: thrust)
_FULL_THRUST_VOLTAGE = 3.0  # [V] at which a motor gives THRUST_MAX (VMOTOR2THRUST in platform_defaults_cf2.h)


class Batteries:
    """Charge and voltage of all batteries.

    Attributes:
        charge: (N,) state of charge, 1 full .. 0 empty; a fault scenario may write it.
        voltage: (N,) under the present load [V].
    """

    def __init__(self, airframes: Sequence[Airframe], charge: float = 0.95) -> None:
        n = len(airframes)
        self.charge = np.full(n, charge)
        self._empty = np.array([a.voltage_empty for a in airframes])
        self._span = np.array([a.voltage_full for a in airframes]) - self._empty
        self._resistance = np.array([a.internal_resistance for a in airframes])
        self._capacity = 3.6 * np.array([a.battery_capacity for a in airframes])  # [A s]
        hover = np.array([a.mass * GRAVITY / (4.0 * a.motor_thrust_max) for a in airframes])  # fraction per motor
        self._power = (np.array([a.hover_power for a in airframes]) - _ELECTRONICS) / (4.0 * hover**1.5)
        self.voltage = self._open_circuit()
        self.draw(np.zeros((n, 4)), 0.0)

    def draw(self, thrust: Array, dt: float) -> None:
        """Deliver rotor thrusts (N, 4), as fractions of the greatest, for dt [s]."""
        power = _ELECTRONICS + self._power * (thrust * np.sqrt(thrust)).sum(axis=1)
        current = power / np.maximum(self.voltage, 1.0)
        self.charge = np.maximum(self.charge - current * (dt / self._capacity), 0.0)
        loaded = np.maximum(self._open_circuit() - self._resistance * current, 0.0)
        self.voltage = np.where(self.charge > 0.0, loaded, 0.0)

    def available_thrust(self) -> Array:
        """(N,) share of the greatest thrust that the voltage allows; an empty battery turns nothing."""
        share = np.minimum(1.0, (self.voltage / _FULL_THRUST_VOLTAGE) ** 2)
        return np.where(self.charge > 0.0, share, 0.0)

    def _open_circuit(self) -> Array:
        out: Array = self._empty + self._span * np.interp(self.charge, _CHARGE, _SHAPE)
        return out
