"""Both controllers side by side, one of them in charge of each drone (stabilizer.controller), and the mixer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from deploy.radio.simulated.physics.estimator import Estimates
from deploy.radio.simulated.physics.mellinger import Mellinger
from deploy.radio.simulated.physics.mixer import mix
from deploy.radio.simulated.physics.pid import CascadedPid
from deploy.radio.simulated.physics.setpoints import SetpointTable
from missions.airframes import Airframe
from missions.arrays import Array

MELLINGER = 2  # stabilizer.controller; everything else flies the default, PID


class Autopilots:
    """What turns estimates and setpoints into motor commands.

    Attributes:
        setpoints: what every drone has to follow.
        thrust: (N,) collective command [counts].
        command: (N, 4) motor commands of the last step [counts].
        moments: (N, 3) about body x, y, z that were asked for at the last step [counts].
        idle: nobody's motors are asked to turn. resting: (N, 1) 1 for whose are not, else 0.
    """

    def __init__(self, airframes: Sequence[Airframe], dt: float) -> None:
        n = len(airframes)
        self.setpoints = SetpointTable(n)
        self._allowed = np.zeros(n, dtype=np.bool_)
        self.thrust = np.zeros(n)
        self.command = np.zeros((n, 4))
        self.moments = np.zeros((n, 3))
        self.idle = True
        self._mellinger, self._pid = Mellinger(airframes, dt), CascadedPid(airframes, dt)
        self._by_mellinger = np.zeros(n, dtype=np.bool_)
        self._some_mellinger, self._some_pid = False, True
        self._turning, self._all_turn = np.zeros((n, 1)), False
        self.resting = np.ones((n, 1))

    @property
    def asked(self) -> Array:
        """(N, 6) attitudes [deg] and body rates [deg/s] that the PID controllers aim at, in charge or not."""
        return self._pid.asked

    def allow(self, index: int, allowed: bool) -> None:
        """The supervisor's word for a drone; without it the motors stand still."""
        self._allowed[index] = allowed

    def choose(self, index: int, controller: int) -> None:
        """Put one controller in charge of a drone."""
        mellinger = controller == MELLINGER
        if mellinger != self._by_mellinger[index]:
            self._by_mellinger[index] = mellinger
            self._some_mellinger = bool(self._by_mellinger.any())
            self._some_pid = not self._by_mellinger.all()

    def tune(self, index: int, changed: Mapping[str, float]) -> None:
        """Take the parameters of one drone's controllers that differ from its airframe's defaults, by name."""
        self._mellinger.tune(index, changed)
        self._pid.tune(index, changed)

    def aim(self, state: Estimates, dt: float) -> None:
        """Once a control tick of dt: the slow loops, from what the drones believe."""
        running = self._allowed & self.setpoints.active
        count = np.count_nonzero(running)
        if count:
            thrust = self._aim(state, dt)
            if count < len(running):
                stopped = np.flatnonzero(~running)
                self._mellinger.reset(stopped)
                self._pid.reset(stopped, state.rotation)
                thrust = thrust * running
            self._take(thrust)
        elif not self.idle:
            everybody = np.arange(len(running))
            self._mellinger.reset(everybody)
            self._pid.reset(everybody, state.rotation)
            self._take(np.zeros(len(running)))

    def _take(self, thrust: Array) -> None:
        """Collective commands; without thrust the firmware gives no moments either."""
        self.thrust = thrust
        turning = thrust > 0.0
        count = np.count_nonzero(turning)
        if count == len(turning) and self._all_turn:
            return
        self.idle, self._all_turn = count == 0, count == len(turning)
        self._turning = turning.astype(np.float64)[:, None]
        self.resting = 1.0 - self._turning

    def steer(self, rotation: Array, rates: Array) -> Array:
        """At every step: motor commands (N, 4) from true attitudes (N, 3, 3) and measured rates (N, 3) [rad/s]."""
        if self._some_mellinger:
            moments = self._mellinger.moments(rotation, rates)
        if self._some_pid:
            by_pid = self._pid.moments(rotation, rates)
            moments = np.where(self._by_mellinger[:, None], moments, by_pid) if self._some_mellinger else by_pid
        command = mix(self.thrust[:, None], moments)
        if not self._all_turn:
            command *= self._turning
        self.command, self.moments = command, moments
        return command

    def _aim(self, state: Estimates, dt: float) -> Array:
        """Thrust commands (N,) by the controllers in charge; what they say of drones that do not run is meaningless."""
        if not self._some_pid:
            return self._mellinger.aim(self.setpoints, state, dt)
        if not self._some_mellinger:
            return self._pid.aim(self.setpoints, state, dt)
        by_mellinger, by_pid = (c.aim(self.setpoints, state, dt) for c in (self._mellinger, self._pid))
        return np.where(self._by_mellinger, by_mellinger, by_pid)
