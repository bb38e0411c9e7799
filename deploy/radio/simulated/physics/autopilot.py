"""Both controllers side by side, one of them in charge of each drone (stabilizer.controller), and the mixer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from deploy.radio.simulated.physics.mellinger import Mellinger
from deploy.radio.simulated.physics.mixer import mix
from deploy.radio.simulated.physics.pid import CascadedPid
from deploy.radio.simulated.physics.rotors import COMMAND_MAX
from deploy.radio.simulated.physics.setpoints import OFF, SetpointTable
from missions.airframes import Airframe
from missions.arrays import Array

MELLINGER = 2  # stabilizer.controller; everything else flies the default, PID


class Autopilots:
    """What turns estimates and setpoints into motor commands.

    Attributes:
        setpoints: what every drone has to follow.
        allowed: (N,) the supervisor's word; without it the motors stand still.
        thrust: (N,) collective command [counts].
        command: (N, 4) motor commands of the last step [counts].
        saturated: (N,) a motor command was clipped since :meth:`aim`.
    """

    def __init__(self, airframes: Sequence[Airframe], dt: float) -> None:
        n = len(airframes)
        self.setpoints = SetpointTable(n)
        self.allowed = np.zeros(n, dtype=np.bool_)
        self.thrust = np.zeros(n)
        self.command = np.zeros((n, 4))
        self.saturated = np.zeros(n, dtype=np.bool_)
        self._mellinger, self._pid = Mellinger(airframes, dt), CascadedPid(airframes, dt)
        self._by_mellinger = np.zeros(n, dtype=np.bool_)
        self._running = np.zeros((n, 1))

    def choose(self, index: int, controller: int) -> None:
        """Put one controller in charge of a drone."""
        self._by_mellinger[index] = controller == MELLINGER

    def aim(self, position: Array, velocity: Array, rotation: Array, dt: float) -> None:
        """Once a control tick of dt: the slow loops, from estimated states (N, 3), (N, 3), (N, 3, 3)."""
        running = self.allowed & (self.setpoints.mode != OFF)
        thrust = np.zeros(len(running))
        for controller, mine in ((self._mellinger, self._by_mellinger), (self._pid, ~self._by_mellinger)):
            if (mine & running).any():
                thrust = np.where(mine, controller.aim(self.setpoints, position, velocity, rotation, dt), thrust)
        if not running.all():
            for controller in (self._mellinger, self._pid):
                controller.reset(np.flatnonzero(~running), rotation)
        self.thrust = thrust * running
        # Without thrust the firmware gives no moments either.
        self._running = (self.thrust > 0.0).astype(np.float64)[:, None]
        self.saturated = np.zeros(len(running), dtype=np.bool_)

    @property
    def idle(self) -> bool:
        """Nobody's motors are asked to turn."""
        return not self._running.any()

    def steer(self, rotation: Array, rates: Array) -> Array:
        """At every step: motor commands (N, 4) from estimated attitudes (N, 3, 3) and measured rates (N, 3) [rad/s]."""
        mellinger = bool(self._by_mellinger.any())
        if mellinger:
            moments = self._mellinger.moments(rotation, rates)
        if not self._by_mellinger.all():
            by_pid = self._pid.moments(rotation, rates)
            moments = np.where(self._by_mellinger[:, None], moments, by_pid) if mellinger else by_pid
        command, clipped = mix(self.thrust[:, None], moments)
        if clipped:
            self.saturated |= command.max(axis=1) >= COMMAND_MAX
        command *= self._running
        self.command = command
        return command
