"""From thrust and moments to four motor commands (power_distribution_quadrotor.c, legacy mode).

Moments are right-handed about body x, y, z in motor counts; the firmware's own pitch and yaw have the other sign.
Roll and pitch are shared by two motors on each side, hence the halves.
"""

from __future__ import annotations

import numpy as np

from deploy.radio.simulated.physics.rotors import COMMAND_MAX, PITCH, ROLL, YAW
from missions.arrays import Array, frozen

_MIX = frozen(np.array([np.multiply(0.5, ROLL), np.multiply(0.5, PITCH), YAW]))  # (3 moments, 4 motors)


def mix(thrust: Array, moments: Array) -> Array:
    """Motor commands (N, 4) in 0..65535 of thrusts (N, 1) and moments (N, 3).

    When a motor would need more than the greatest command, all four are lowered alike (powerDistributionCap): the
    moments are kept and thrust is what gives way. Commands that are no numbers (gains or setpoints that are none) turn
    no motor here; on hardware they are garbage.
    """
    command: Array = moments.dot(_MIX)
    command += thrust
    if not np.maximum.reduce(command, None) <= COMMAND_MAX:  # also when it is no number
        command[~np.isfinite(command).all(axis=1)] = 0.0
        command -= np.maximum(command.max(axis=1, keepdims=True) - COMMAND_MAX, 0.0)
    return np.maximum(command, 0.0, out=command)
