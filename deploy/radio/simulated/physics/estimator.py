"""Every drone's own idea of its pose: an error-state Kalman filter over what arrived by radio.

A filter's error obeys an equation of its own that does not need the strap-down integration: with true specific force f
(world frame) and a true-to-estimated rotation D,

    ė_p = e_v,    ė_v = D f_sensed − f,    Ḋ = [gyro error, world frame]× D

which is exact (D may be any rotation: a wrong initial heading is one). So the world integrates truth at 500 Hz and this
file only the error, at 100 Hz; the estimate is truth with the error on top. Measurements enter through the innovation
between what was measured and what was estimated, as they would. A late, wrong or missing pose therefore misleads the
estimate just as it misleads a drone's, and nothing here knows the truth but through its sensors.

Covariance and noise as the firmware's extended Kalman filter (estimator_kalman.c, kalman_core.c, parameters kalman.*),
reduced to nine states: position, velocity (world frame), attitude.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from deploy.radio.simulated.interface import PoseMeasurement, Vec3
from deploy.radio.simulated.physics import algebra
from deploy.radio.simulated.physics.algebra import Index
from missions.arrays import Array, frozen

# kalman.pNAcc_xy, pNAcc_z, mNGyro_*. Added every millisecond (estimator_kalman.c: "every loop, rather than every
# prediction") as the squares of ½ a dt², a dt and ω dt, so the sum over a tick is smaller than one step of it would be.
_ACCELERATION_NOISE = frozen([0.5, 0.5, 1.0])  # [m/s²]
_LOOP = 0.001  # [s]
_GYRO_NOISE = frozen([0.1, 0.1, 0.1])  # [rad/s]
# kalman_core.c: stdDevInitialPosition_*, stdDevInitialVelocity, stdDevInitialAttitude_*.
_INITIAL_DEVIATION = frozen([100.0, 100.0, 1.0, 0.01, 0.01, 0.01, 0.01, 0.01, 0.01])
_LEAST, _MOST = 1e-6, 100.0**2  # MIN_COVARIANCE, MAX_COVARIANCE
_FARTHEST, _FASTEST = 100.0, 10.0  # kalman.maxPos, kalman.maxVel: beyond, the firmware starts its filter again
_NOBODY = np.zeros(0, dtype=np.intp)
_MEASURED = frozen(np.eye(9)[:, [0, 1, 2, 6, 7, 8]])  # Hᵀ: position and attitude
_UNMEASURED = 1e6  # standard deviation that makes an attitude measurement have no effect


class Estimators:
    """Errors and covariances of N filters.

    Attributes:
        position_error, velocity_error: (N, 3) estimate minus truth, world frame.
        rotation_error: (N, 4) D as quaternions, (N, 3, 3) in ``matrix``.
        covariance: (N, 9, 9) what the filter believes of its own error.
    """

    def __init__(self, n: int) -> None:
        self.position_error, self.velocity_error = np.zeros((n, 3)), np.zeros((n, 3))
        self.rotation_error = np.tile([0.0, 0.0, 0.0, 1.0], (n, 1))
        self.matrix = np.tile(np.eye(3), (n, 1, 1))
        self.covariance = np.tile(np.diag(_INITIAL_DEVIATION**2), (n, 1, 1))
        self._transition = np.tile(np.eye(9), (n, 1, 1))

    def reset(self, index: int, position: Array, velocity: Array, quaternion: Array, to: tuple[Vec3, float]) -> None:
        """Start one filter at rest at a position and heading ``to``; the other arguments are the drone's truth."""
        self.position_error[index] = np.asarray(to[0]) - position
        self.velocity_error[index] = -velocity
        level = algebra.yaw_quaternions(np.array([to[1]]))
        self.rotation_error[index] = algebra.multiply(level, algebra.conjugate(quaternion[None]))[0]
        self.matrix[index] = algebra.rotation_matrices(self.rotation_error[index][None])[0]
        self.covariance[index] = np.diag(_INITIAL_DEVIATION**2)

    def predict(self, force: Array, sensed: Array, gyro_error: Array, dt: float) -> None:
        """One prediction of dt.

        Args:
            force: (N, 3) true specific force, mean over dt, world frame [m/s²].
            sensed: (N, 3) the same as the filter takes it from the accelerometers, turned by the true attitude.
            gyro_error: (N, 3) mean over dt, world frame [rad/s].
            dt: [s].
        """
        felt = np.matmul(self.matrix, sensed[:, :, None])[:, :, 0]
        change = felt - force
        self.position_error += dt * self.velocity_error + (0.5 * dt * dt) * change
        self.velocity_error += dt * change
        turn = np.matmul(self.matrix, gyro_error[:, :, None])[:, :, 0]
        self._rotate(dt * turn)
        f = self._transition
        f[:, [0, 1, 2], [3, 4, 5]] = dt
        f[:, 3:6, 6:9] = -dt * algebra.skew(felt)
        p = np.matmul(np.matmul(f, self.covariance), f.transpose(0, 2, 1))
        diagonal = np.einsum("nii->ni", p)
        diagonal += _process_noise(dt)
        self.covariance = p

    def correct(self, measured: Sequence[tuple[int, PoseMeasurement]], position: Array, quaternion: Array) -> None:
        """Take at most one pose per drone: (drone, measurement) pairs; position and quaternion are the truth (N, ·)."""
        index = np.array([i for i, _ in measured])
        poses = [m for _, m in measured]
        seen = np.array([m.position for m in poses])
        innovation = np.zeros((len(index), 6))
        innovation[:, :3] = seen - position[index] - self.position_error[index]
        estimated = algebra.multiply(self.rotation_error[index], quaternion[index])
        attitude = np.array(
            [e if m.quaternion is None else m.quaternion for m, e in zip(poses, estimated, strict=True)]
        )
        difference = algebra.multiply(algebra.normalised(attitude), algebra.conjugate(estimated))
        innovation[:, 3:] = algebra.logarithm(difference)
        deviation = np.array(
            [(m.std_position, _UNMEASURED if m.quaternion is None else m.std_quaternion) for m in poses]
        )
        self._update(index, innovation, np.repeat(deviation**2, 3, axis=1))

    def lost(self, position: Array, velocity: Array) -> Index:
        """Indices of filters that left the allowed range, of estimates (N, 3); the firmware would reset them."""
        far, fast = np.abs(position), np.abs(velocity)
        if np.maximum.reduce(far, None) <= _FARTHEST and np.maximum.reduce(fast, None) <= _FASTEST:
            return _NOBODY
        return np.flatnonzero((far > _FARTHEST).any(axis=1) | (fast > _FASTEST).any(axis=1))

    def _update(self, index: Index, innovation: Array, noise: Array) -> None:
        """Kalman update of some drones: innovations (K, 6) of position and attitude, noise variances (K, 6)."""
        p = self.covariance[index]
        ph = np.matmul(p, _MEASURED)
        s = np.matmul(_MEASURED.T, ph)
        s.reshape(len(index), 36)[:, ::7] += noise  # the diagonals
        hp = ph.transpose(0, 2, 1)
        weights = np.linalg.solve(s, hp)  # S⁻¹ H P: the gain's transpose, S being symmetric
        step = np.matmul(innovation[:, None, :], weights)[:, 0]
        self.position_error[index] += step[:, :3]
        self.velocity_error[index] += step[:, 3:6]
        rotation = np.zeros_like(self.position_error)
        rotation[index] = step[:, 6:]
        self._rotate(rotation)
        p = p - np.matmul(ph, weights)
        p = 0.5 * (p + p.transpose(0, 2, 1))
        diagonal = p.reshape(len(index), 81)[:, ::10]
        np.minimum(np.maximum(diagonal, _LEAST), _MOST, out=diagonal)
        self.covariance[index] = p

    def _rotate(self, rotation: Array) -> None:
        """Turn the estimated attitudes by rotation vectors (N, 3), world frame."""
        turned = algebra.multiply(algebra.exponential(rotation), self.rotation_error)
        self.rotation_error = algebra.normalised(turned)
        self.matrix = algebra.rotation_matrices(self.rotation_error)


@functools.cache
def _process_noise(dt: float) -> Array:
    loop = _LOOP
    one = np.concatenate([0.5 * loop * loop * _ACCELERATION_NOISE, loop * _ACCELERATION_NOISE, loop * _GYRO_NOISE]) ** 2
    return one * (dt / loop)
