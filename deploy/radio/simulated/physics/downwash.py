"""The air below a hovering drone, and what it does to another one.

A drone's rotor wake is taken as one round turbulent jet whose momentum flux is its thrust T: a Gaussian profile of
half-width b = b0 + 0.107 Δz (spreading rate of a round jet; Pope, Turbulent Flows, 5.1), centre speed √(2T/(ρ π b²)).
A drone at horizontal distance r and Δz below loses DRAG × speed of upward force. Calibrated in size only: 0.3 m below a
30 g drone that is 0.08 N, of the size that published measurements on Crazyflies show (Neural-Swarm, ICRA 2020).
Idealised: no lateral force, no swirl, no ground effect, wakes of several drones simply add.
"""

from __future__ import annotations

import numpy as np

from missions.arrays import Array

_AIR_DENSITY = 1.2  # [kg/m³]
_NOZZLE = 0.065  # [m] half-width at the rotors: four 23 mm rotors around a 46 mm arm
_SPREADING = 0.107
_DRAG = 0.02  # [N s/m] estimate, see above
CLEAR = 0.05  # [m] side by side: the jet has not formed
_REACH = 3.0  # [m] further below, room air has mixed it away


def downwash(position: Array, thrust: Array) -> Array:
    """Downward forces (N,) [N] on every drone from the wakes of all others.

    Args:
        position: (N, 3) [m].
        thrust: (N,) present thrust of each drone [N].
    """
    offset = position[:, None, :] - position[None, :, :]  # [i, j]: from the drone below (j) to the one above (i)
    below = offset[:, :, 2]
    in_wake = (below > CLEAR) & (below < _REACH)
    width = _NOZZLE + _SPREADING * np.where(in_wake, below, 0.0)
    distance_squared = (offset[:, :, :2] ** 2).sum(axis=2)
    centre = np.sqrt(2.0 * thrust / (_AIR_DENSITY * np.pi))[:, None] / width
    speed = np.where(in_wake, centre * np.exp(-distance_squared / width**2), 0.0)
    out: Array = _DRAG * speed.sum(axis=0)
    return out
