"""Geometric tracking controller (controller_mellinger.c), for all drones at once.

D. Mellinger, V. Kumar: Minimum snap trajectory generation and control for quadrotors, ICRA 2011, with the firmware's
integrals and angular-acceleration term. Gains are the defaults that the recorded firmware reports (ctrlMel.*).

The firmware runs all of it at 500 Hz. Here the force loop runs at 100 Hz, the rate at which high-level setpoints and
poses change; the attitude loop, which is what is fast, runs at every step.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from deploy.radio.simulated.physics import algebra, setpoints
from deploy.radio.simulated.physics.algebra import GRAVITY, Index
from deploy.radio.simulated.physics.setpoints import SetpointTable
from missions.airframes import Airframe
from missions.arrays import Array, frozen

_KP = frozen([0.4, 0.4, 1.25])  # position [N/m]
_KD = frozen([0.2, 0.2, 0.4])  # velocity [N s/m]
_KI = frozen([0.05, 0.05, 0.05])  # [N/(m s)]; ki_z as the recorded firmware reports it
_I_RANGE = frozen([2.0, 2.0, 0.4])  # [m s]
_KR = (70000.0, 70000.0, 60000.0)  # attitude [counts], of an error that is twice the angle
_KW = (20000.0, 20000.0, 12000.0)  # rates [counts s/rad]
_KD_OMEGA = 200.0  # roll and pitch acceleration [counts s²/rad]
_KI_YAW, _I_RANGE_YAW = 500.0, 1500.0
_MOMENT_MAX = 32000.0
# massThrust 132000 counts/N is for motors of 0.12 N, 3.3 % less than ideal: 8 mm of sag, seen in the recordings.
# Stronger motors need proportionally less: what a user of another airframe has to set in ctrlMel.massThrust.
_MASS_THRUST, _MASS_THRUST_MOTOR = 132000.0, 0.12
# vee(A - Aᵀ) of A = R_desᵀ R, as a linear map of A's nine entries.
_VEE = frozen(
    [
        [0, 0, 0],
        [0, 0, -1],
        [0, 1, 0],
        [0, 0, 1],
        [0, 0, 0],
        [-1, 0, 0],
        [0, -1, 0],
        [1, 0, 0],
        [0, 0, 0],
    ]
)


class Mellinger:
    """State of N controllers. ``aim`` at 100 Hz, ``moments`` at every step."""

    def __init__(self, airframes: Sequence[Airframe], dt: float) -> None:
        n = len(airframes)
        self._dt = dt
        self._mass = np.array([[a.mass] for a in airframes])
        self._mass_thrust = np.array([_MASS_THRUST * _MASS_THRUST_MOTOR / a.motor_thrust_max for a in airframes])
        self._integral = np.zeros((n, 3))
        self._desired_transposed = np.tile(np.eye(3), (n, 1, 1))
        self._omega = np.zeros((n, 3))
        # Columns: attitude error, rate error, rate error before, yaw integral: one product gives the moments.
        self._errors = np.zeros((n, 10))
        self._gains = np.zeros((10, 3))
        self._gains[0:3] = np.diag(np.negative(_KR))
        self._gains[3:6] = np.diag(_KW) + np.diag([_KD_OMEGA / dt, _KD_OMEGA / dt, 0.0])
        self._gains[6:9] = -np.diag([_KD_OMEGA / dt, _KD_OMEGA / dt, 0.0])
        self._gains[9, 2] = _KI_YAW

    def aim(self, target: SetpointTable, position: Array, velocity: Array, rotation: Array, dt: float) -> Array:
        """Force loop: desired attitudes for :meth:`moments`; returns the thrust commands (N,) in counts.

        Args:
            target: what to follow.
            position: estimated (N, 3) [m].
            velocity: estimated (N, 3) [m/s].
            rotation: estimated attitudes (N, 3, 3).
            dt: time since the last call [s].
        """
        mode = target.mode
        full = (mode == setpoints.FULL)[:, None]
        track = full[:, 0] | (mode == setpoints.POSITION)
        manual = mode == setpoints.ATTITUDE
        error = target.position - position
        self._integral = np.minimum(np.maximum(self._integral + error * dt, -_I_RANGE), _I_RANGE)
        force = _KP * error + _KD * (full * target.velocity - velocity) + _KI * self._integral
        force += self._mass * (full * target.acceleration)
        # Velocity modes are unknown to this controller: it levels out and holds the height it finds in the setpoint.
        force[~track, :2] = 0.0
        force[:, 2] += self._mass[:, 0] * GRAVITY
        yaw = target.yaw
        if not track.all():
            yaw = np.where(track, yaw, algebra.heading(rotation) + manual * (self._dt * target.omega[:, 2]))
        desired = _attitude(algebra.normalised(force), yaw)
        if manual.any():
            desired[manual] = _tilted(target.attitude[manual], yaw[manual])
        self._desired_transposed = np.ascontiguousarray(desired.transpose(0, 2, 1))
        self._omega = target.omega * np.where(manual[:, None], (0.0, 0.0, 1.0), full)
        thrust = np.where(manual, target.thrust, self._mass_thrust * (force * rotation[:, :, 2]).sum(axis=1))
        if thrust.min() <= 0.0:
            self.reset(np.flatnonzero(thrust <= 0.0), rotation)
        return np.maximum(thrust, 0.0)

    def moments(self, rotation: Array, rates: Array) -> Array:
        """Moments (N, 3) about body x, y, z in counts from estimated attitudes and measured rates [rad/s]."""
        e = self._errors
        e[:, 6:9] = e[:, 3:6]
        e[:, 0:3] = np.matmul(self._desired_transposed, rotation).reshape(-1, 9).dot(_VEE)
        np.subtract(self._omega, rates, out=e[:, 3:6])
        e[:, 9] -= self._dt * e[:, 2]
        moments: Array = e.dot(self._gains)
        return np.minimum(np.maximum(moments, -_MOMENT_MAX), _MOMENT_MAX)

    def reset(self, index: Index, rotation: Array) -> None:
        """Forget the integrals of some drones (motors off). ``rotation`` is not needed by this controller."""
        self._integral[index] = 0.0
        self._errors[index, 9] = 0.0


def _attitude(z_axis: Array, yaw: Array) -> Array:
    """Matrices (N, 3, 3) with the given z axes and headings."""
    ahead = np.zeros((len(yaw), 3))
    np.cos(yaw, out=ahead[:, 0])
    np.sin(yaw, out=ahead[:, 1])
    out = np.empty((len(yaw), 3, 3))
    y_axis = algebra.normalised(algebra.cross(z_axis, ahead))
    out[:, :, 0], out[:, :, 1], out[:, :, 2] = algebra.cross(y_axis, z_axis), y_axis, z_axis
    return out


def _tilted(attitude: Array, yaw: Array) -> Array:
    """Matrices of roll, pitch (N, 2) and yaw (N,): Rz(yaw) Ry(pitch) Rx(roll)."""
    zero = np.zeros_like(yaw)
    q = algebra.exponential(np.stack([attitude[:, 0], zero, zero], axis=1))
    q = algebra.multiply(algebra.exponential(np.stack([zero, attitude[:, 1], zero], axis=1)), q)
    return algebra.rotation_matrices(algebra.multiply(algebra.yaw_quaternions(yaw), q))
