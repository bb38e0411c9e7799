"""Cascaded PID controller (controller_pid.c, position_controller_pid.c, attitude_pid_controller.c), for all drones.

position → velocity (100 Hz) → attitude → rates (every step). Angles in degrees and thrust in counts, the units of the
firmware's gains; pitch and yaw right-handed about body y and z. No feed-forward of the setpoint's velocity: that is
where the recorded lag of half a second comes from (position gain 2 1/s).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from deploy.radio.simulated.physics import setpoints
from deploy.radio.simulated.physics.algebra import Index
from deploy.radio.simulated.physics.estimator import Estimates
from deploy.radio.simulated.physics.rotors import COMMAND_MAX
from deploy.radio.simulated.physics.setpoints import SetpointTable
from deploy.radio.simulated.physics.tuning import Tuning, columns, per_drone
from deploy.radio.simulated.platform_defaults import platform_defaults
from missions.airframes import Airframe
from missions.arrays import Array

_OVERHEAD = 1.1  # velMaxOverhead, rpLimitOverhead
_VELOCITY_MAX, _TILT_MAX = 1.0, 20.0  # [m/s], [degrees]
_LEAST_CLIMB_MAX = 0.5  # [m/s] position_controller_pid.c keeps zVelMax above it
_THRUST_SCALE, _THRUST_MIN = 1000.0, 20000.0
_NOBODY: Index = np.zeros(0, dtype=np.intp)
_UNLIMITED = 5000.0  # DEFAULT_PID_INTEGRATION_LIMIT


class Pid:
    """N × k PID regulators (pid.c): derivative of the measurement, clamped integral and output.

    Attributes:
        kp, ki, kd, kff, limit: (N, k) gains and greatest size of the output; whoever writes them calls :meth:`tuned`.

    Args:
        kp, ki, kd: gains, any shape that broadcasts to ``shape``.
        i_limit, limit: greatest size of the integral (before its gain) and of the output.
        shape: (N, k).
        cyclic: the measurement is an angle in degrees and may jump by a turn.
    """

    def __init__(
        self,
        kp: ArrayLike,
        ki: ArrayLike,
        kd: ArrayLike,
        i_limit: ArrayLike,
        limit: ArrayLike,
        shape: tuple[int, int],
        cyclic: bool = False,
    ) -> None:
        self.kp, self.ki, self.kd, self.kff = (per_drone(k, *shape) for k in (kp, ki, kd, 0.0))
        self._i_limit, self.limit = np.asarray(i_limit, dtype=np.float64), per_drone(limit, *shape)
        self._cyclic = cyclic
        self._integral, self._before = np.zeros(shape), np.zeros(shape)
        self._unknown = False  # somebody has no measurement before
        self.tuned()

    def tuned(self) -> None:
        """Take note of gains that were written from outside."""
        self._differential, self._ahead = bool(self.kd.any()), bool(self.kff.any())

    def update(self, error: Array, measured: Array, dt: float) -> Array:
        """Outputs (N, k). The caller wraps angles in ``error``."""
        self._integral = np.minimum(np.maximum(self._integral + error * dt, -self._i_limit), self._i_limit)
        out = self.kp * error + self.ki * self._integral
        if self._differential:
            step = measured - self._before
            if self._cyclic:
                step = (step + 180.0) % 360.0 - 180.0
            if self._unknown:
                step[np.isnan(step)], self._unknown = 0.0, False
            out -= (self.kd / dt) * step
            self._before = measured
        if self._ahead:
            out += self.kff * (error + measured)
        return np.minimum(np.maximum(out, -self.limit), self.limit)

    def reset(self, index: Index, measured: Array | float) -> None:
        """Start afresh for some drones; a ``measured`` of not-a-number is not known yet."""
        self._integral[index] = 0.0
        self._before[index] = measured[index] if isinstance(measured, np.ndarray) else measured
        self._unknown |= not isinstance(measured, np.ndarray) and math.isnan(measured)


class CascadedPid:
    """State of N controllers. ``aim`` at 100 Hz, ``moments`` at every step."""

    def __init__(self, airframes: Sequence[Airframe], dt: float) -> None:
        n = len(airframes)
        self._dt = dt
        defaults = [platform_defaults(a) for a in airframes]
        # Columns: thrustBase, thrustMin; xVelMax, yVelMax, zVelMax; rLimit, pLimit.
        self._thrust = np.array([(d["posCtlPid.thrustBase"], _THRUST_MIN) for d in defaults])
        self._velocity_max, self._tilt_max = per_drone(_VELOCITY_MAX, n, 3), per_drone(_TILT_MAX, n, 2)
        self._position = Pid(2.0, (0.0, 0.0, 0.5), 0.0, _UNLIMITED, 0.0, (n, 3))
        self._velocity = Pid(25.0, (1.0, 1.0, 15.0), 0.0, _UNLIMITED, COMMAND_MAX / 2000.0, (n, 3))
        self._angle = Pid(6.0, (3.0, 3.0, 1.0), (0.0, 0.0, 0.35), (20.0, 20.0, 360.0), np.inf, (n, 3), cyclic=True)
        kp, ki = (
            np.array([(d[f"pid_rate.roll_{gain}"], d[f"pid_rate.pitch_{gain}"], yaw) for d in defaults])
            for gain, yaw in (("kp", 120.0), ("ki", 16.7))
        )
        self._rate = Pid(kp, ki, (2.5, 2.5, 0.0), (33.3, 33.3, 166.7), 32767.0, (n, 3))
        self._yaw_max_delta = np.zeros((n, 1))  # [degrees] 0: none
        self._tuning = Tuning(self._parameters())
        self._tuned()
        self._desired = np.zeros((n, 3))  # roll, pitch, yaw [degrees]
        self._desired_rates = np.zeros((n, 3))  # [degrees/s]
        self._turning = np.zeros((n, 2))  # roll and pitch rates [degrees/s] of those who are given rates
        self._rates: Index = _NOBODY
        self._mode = np.zeros(n, dtype=np.int64)
        self._misalignment = np.tile(np.eye(3), (n, 1, 1))

    def tune(self, index: int, changed: Mapping[str, float]) -> None:
        """Take one drone's parameters posCtlPid.*, velCtlPid.*, pid_attitude.* and pid_rate.* (not the filters')."""
        if self._tuning.put(index, changed):
            self._tuned()

    @property
    def asked(self) -> Array:
        """(N, 6) roll, pitch, yaw [degrees] and body rates [degrees/s] aimed at."""
        return np.concatenate([self._desired, self._desired_rates], axis=1)

    def aim(self, target: SetpointTable, state: Estimates, dt: float) -> Array:
        """Position and velocity loops: desired angles for :meth:`moments`; returns the thrust commands (N,) in counts.

        Args:
            target: what to follow.
            state: what the drones believe.
            dt: time since the last call [s].
        """
        mode = target.mode
        self._misalignment = state.misalignment
        angles = _angles(state.rotation)
        changed = np.flatnonzero(mode != self._mode)
        if len(changed):
            self._reset(changed, angles)
            self._mode = mode.copy()
        cosine, sine = np.cos(np.radians(angles[:, 2])), np.sin(np.radians(angles[:, 2]))
        here = _in_heading(state.position, cosine, sine)
        wanted = self._position.update(_in_heading(target.position, cosine, sine) - here, here, dt)
        asked = _in_heading(target.velocity, cosine, sine)
        asked[mode == setpoints.HOVER] = target.velocity[mode == setpoints.HOVER]  # given in the body frame already
        by_position, manual = target.by_position, target.manual
        wanted = np.where(np.stack([by_position, by_position, target.by_height], axis=1), wanted, asked)
        speed = _in_heading(state.velocity, cosine, sine)
        drive = self._velocity.update(wanted - speed, speed, dt)
        tilt = np.clip(np.stack([-drive[:, 1], drive[:, 0]], axis=1), -self._tilt_max, self._tilt_max)
        self._desired[:, :2] = np.where(target.leaning[:, None], np.degrees(target.attitude), tilt)
        turned = self._desired[:, 2] + np.degrees(target.omega[:, 2]) * dt
        if self._yaw_tied:
            turned = _within(turned, angles[:, 2], self._yaw_max_delta[:, 0])
        self._desired[:, 2] = np.where(by_position, np.degrees(target.yaw), turned)
        thrust = np.maximum(drive[:, 2] * _THRUST_SCALE + self._thrust[:, 0], self._thrust[:, 1])
        np.minimum(thrust, COMMAND_MAX, out=thrust)
        thrust = np.where(manual, target.thrust, thrust)
        self._rates = np.flatnonzero(target.rates) if target.any_rates else _NOBODY
        self._turning[self._rates] = np.degrees(target.omega[self._rates, :2])
        off = (mode == setpoints.OFF) | (thrust <= 0.0)
        if off.any():
            self._reset(np.flatnonzero(off), angles)
        return np.where(off, 0.0, thrust)

    def moments(self, rotation: Array, rates: Array) -> Array:
        """Moments (N, 3) about body x, y, z in counts from true attitudes (N, 3, 3) and measured rates [rad/s]."""
        angles = _angles(np.matmul(self._misalignment, rotation))
        error = self._desired - angles
        error[:, 2] = (error[:, 2] + 180.0) % 360.0 - 180.0
        measured = np.degrees(rates)
        wanted = self._angle.update(error, angles, self._dt)
        if len(self._rates):
            wanted[self._rates, :2] = self._turning[self._rates]
        self._desired_rates = wanted
        return self._rate.update(wanted - measured, measured, self._dt)

    def reset(self, index: Index, rotation: Array) -> None:
        """Forget the integrals of some drones (motors off); ``rotation``: estimated attitudes (N, 3, 3)."""
        if len(index):
            self._reset(index, _angles(rotation))

    def _parameters(self) -> dict[str, Array | tuple[Array, ...]]:
        out: dict[str, Array | tuple[Array, ...]] = {}
        loops = (
            ("posCtlPid.", "x y z", ("Kp", "Ki", "Kd", "Kff"), self._position),
            ("velCtlPid.", "vx vy vz", ("Kp", "Ki", "Kd", "KFF"), self._velocity),
            ("pid_attitude.", "roll_ pitch_ yaw_", ("kp", "ki", "kd", "kff"), self._angle),
            ("pid_rate.", "roll_ pitch_ yaw_", ("kp", "ki", "kd", "kff"), self._rate),
        )
        for group, axes, gains, loop in loops:
            for gain, array in zip(gains, (loop.kp, loop.ki, loop.kd, loop.kff), strict=True):
                out |= columns(group, " ".join(axis + gain for axis in axes.split()), array)
        out |= columns("posCtlPid.", "thrustBase thrustMin", self._thrust)
        out |= columns("posCtlPid.", "xVelMax yVelMax zVelMax", self._velocity_max)
        out |= columns("posCtlPid.", "rLimit pLimit", self._tilt_max)
        return out | columns("pid_attitude.", "yawMaxDelta", self._yaw_max_delta)

    def _tuned(self) -> None:
        """What follows from the parameters."""
        self._position.limit[:] = _OVERHEAD * self._velocity_max
        np.maximum(self._position.limit[:, 2], _OVERHEAD * _LEAST_CLIMB_MAX, out=self._position.limit[:, 2])
        self._velocity.limit[:, :2] = _OVERHEAD * self._tilt_max[:, ::-1]  # along x it is pitch that drives
        for loop in (self._position, self._velocity, self._angle, self._rate):
            loop.tuned()
        self._yaw_tied = bool(self._yaw_max_delta.any())

    def _reset(self, index: Index, angles: Array) -> None:
        self._position.reset(index, math.nan)
        self._velocity.reset(index, 0.0)
        self._angle.reset(index, angles)
        self._rate.reset(index, 0.0)
        self._desired[index, 2] = angles[index, 2]


def _within(angle: Array, of: Array, most: Array) -> Array:
    """Angles (N,) [degrees] at most so far from others; a limit of 0 is none."""
    ahead = (angle - of + 180.0) % 360.0 - 180.0
    return np.where(most > 0.0, of + np.clip(ahead, -most, most), angle)


def _angles(rotation: Array) -> Array:
    """Roll, pitch, yaw (N, 3) [degrees], R = Rz(yaw) Ry(pitch) Rx(roll)."""
    r = rotation.reshape(-1, 9)
    sines = np.stack([r[:, 7], -r[:, 6], r[:, 3]], axis=1)
    cosines = np.stack([r[:, 8], np.hypot(r[:, 7], r[:, 8]), r[:, 0]], axis=1)
    angles: Array = np.degrees(np.arctan2(sines, cosines))
    return angles


def _in_heading(vector: Array, cosine: Array, sine: Array) -> Array:
    """World vectors (N, 3) in the frame that is turned by the heading only."""
    x, y = vector[:, 0], vector[:, 1]
    return np.stack([cosine * x + sine * y, cosine * y - sine * x, vector[:, 2]], axis=1)
