"""Cascaded PID controller (controller_pid.c, position_controller_pid.c, attitude_pid_controller.c), for all drones.

position → velocity (100 Hz) → attitude → rates (every step). Angles in degrees and thrust in counts, the units of the
firmware's gains; pitch and yaw right-handed about body y and z. No feed-forward of the setpoint's velocity: that is
where the recorded lag of half a second comes from (position gain 2 1/s).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from deploy.radio.simulated.physics import setpoints
from deploy.radio.simulated.physics.algebra import Index
from deploy.radio.simulated.physics.estimator import Estimates
from deploy.radio.simulated.physics.rotors import COMMAND_MAX
from deploy.radio.simulated.physics.setpoints import SetpointTable
from missions.airframes import Airframe
from missions.arrays import Array

_OVERHEAD = 1.1  # velMaxOverhead, rpLimitOverhead
_VELOCITY_MAX, _TILT_MAX = 1.0, 20.0  # [m/s], [degrees]
_THRUST_SCALE, _THRUST_MIN = 1000.0, 20000.0
# Brushed airframes and the Brushless one have different defaults (platform_defaults_cf2.h, _cf21bl.h): thrust base,
# rate gains. The Brushless is told by its motors.
_BRUSHED = (36000.0, (250.0, 250.0, 120.0), (500.0, 500.0, 16.7))
_BRUSHLESS = (30000.0, (200.0, 200.0, 120.0), (400.0, 400.0, 16.7))
_BRUSHLESS_MOTOR = 0.19  # [N]


class Pid:
    """N × k PID regulators (pid.c): derivative of the measurement, clamped integral and output.

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
        self._kp, self._ki, self._kd = (np.broadcast_to(np.asarray(k, dtype=np.float64), shape) for k in (kp, ki, kd))
        self._i_limit, self._limit = np.asarray(i_limit, dtype=np.float64), np.asarray(limit, dtype=np.float64)
        self._cyclic = cyclic
        self._differential = bool(self._kd.any())
        self._integral, self._before = np.zeros(shape), np.zeros(shape)

    def update(self, error: Array, measured: Array, dt: float) -> Array:
        """Outputs (N, k). The caller wraps angles in ``error``."""
        self._integral = np.minimum(np.maximum(self._integral + error * dt, -self._i_limit), self._i_limit)
        out = self._kp * error + self._ki * self._integral
        if self._differential:
            step = measured - self._before
            if self._cyclic:
                step = (step + 180.0) % 360.0 - 180.0
            out -= (self._kd / dt) * step
            self._before = measured
        return np.minimum(np.maximum(out, -self._limit), self._limit)

    def reset(self, index: Index, measured: Array | float) -> None:
        """Start afresh for some drones."""
        self._integral[index] = 0.0
        self._before[index] = measured[index] if isinstance(measured, np.ndarray) else measured


class CascadedPid:
    """State of N controllers. ``aim`` at 100 Hz, ``moments`` at every step."""

    def __init__(self, airframes: Sequence[Airframe], dt: float) -> None:
        n = len(airframes)
        self._dt = dt
        defaults = [_BRUSHLESS if a.motor_thrust_max > _BRUSHLESS_MOTOR else _BRUSHED for a in airframes]
        self._thrust_base = np.array([base for base, _, _ in defaults])
        unlimited = 5000.0  # DEFAULT_PID_INTEGRATION_LIMIT
        speed = _OVERHEAD * _VELOCITY_MAX
        tilt = _OVERHEAD * _TILT_MAX
        self._position = Pid(2.0, (0.0, 0.0, 0.5), 0.0, unlimited, speed, (n, 3))
        self._velocity = Pid(25.0, (1.0, 1.0, 15.0), 0.0, unlimited, (tilt, tilt, COMMAND_MAX / 2000.0), (n, 3))
        self._angle = Pid(6.0, (3.0, 3.0, 1.0), (0.0, 0.0, 0.35), (20.0, 20.0, 360.0), np.inf, (n, 3), cyclic=True)
        kp, ki = np.array([p for _, p, _ in defaults]), np.array([i for _, _, i in defaults])
        self._rate = Pid(kp, ki, (2.5, 2.5, 0.0), (33.3, 33.3, 166.7), 32767.0, (n, 3))
        self._desired = np.zeros((n, 3))  # roll, pitch, yaw [degrees]
        self._mode = np.zeros(n, dtype=np.int64)
        self._misalignment = np.tile(np.eye(3), (n, 1, 1))

    def aim(self, target: SetpointTable, state: Estimates, dt: float) -> Array:
        """Position and velocity loops: desired angles for :meth:`moments`; returns the thrust commands (N,) in counts.

        Args:
            target: what to follow.
            state: what the drones believe.
            dt: time since the last call [s].
        """
        mode, velocity = target.mode, state.velocity
        self._misalignment = state.misalignment
        angles = _angles(state.rotation)
        changed = np.flatnonzero(mode != self._mode)
        if len(changed):
            self._reset(changed, angles)
            self._mode = mode.copy()
        cosine, sine = np.cos(np.radians(angles[:, 2])), np.sin(np.radians(angles[:, 2]))
        error = _in_heading(target.position - state.position, cosine, sine)
        wanted = self._position.update(error, error, dt)
        asked = _in_heading(target.velocity, cosine, sine)
        asked[mode == setpoints.HOVER] = target.velocity[mode == setpoints.HOVER]  # given in the body frame already
        by_position, manual = target.by_position, target.manual
        height_by_position = by_position | (mode == setpoints.HOVER)
        wanted = np.where(np.stack([by_position, by_position, height_by_position], axis=1), wanted, asked)
        drive = self._velocity.update(wanted - _in_heading(velocity, cosine, sine), velocity, dt)
        tilt = np.clip(np.stack([-drive[:, 1], drive[:, 0]], axis=1), -_TILT_MAX, _TILT_MAX)
        self._desired[:, :2] = np.where(manual[:, None], np.degrees(target.attitude), tilt)
        turned = self._desired[:, 2] + np.degrees(target.omega[:, 2]) * dt
        self._desired[:, 2] = np.where(by_position, np.degrees(target.yaw), turned)
        thrust = np.clip(drive[:, 2] * _THRUST_SCALE + self._thrust_base, _THRUST_MIN, COMMAND_MAX)
        thrust = np.where(manual, target.thrust, thrust)
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
        return self._rate.update(wanted - measured, measured, self._dt)

    def reset(self, index: Index, rotation: Array) -> None:
        """Forget the integrals of some drones (motors off); ``rotation``: estimated attitudes (N, 3, 3)."""
        if len(index):
            self._reset(index, _angles(rotation))

    def _reset(self, index: Index, angles: Array) -> None:
        self._position.reset(index, 0.0)
        self._velocity.reset(index, 0.0)
        self._angle.reset(index, angles)
        self._rate.reset(index, 0.0)
        self._desired[index, 2] = angles[index, 2]


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
