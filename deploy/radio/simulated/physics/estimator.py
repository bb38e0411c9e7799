"""Every drone's own idea of its pose: an error-state Kalman filter over what arrived by radio.

A filter's error obeys an equation of its own that does not need the strap-down integration: with true specific force f
(world frame) and a true-to-estimated rotation D,

    ė_p = e_v,    ė_v = D f_sensed − f,    Ḋ = [gyro error, world frame]× D

which is exact (D may be any rotation: a wrong initial heading is one). So the world integrates truth in small steps and
this file only the error, at 100 Hz; the estimate is truth with the error on top. Measurements enter through the
innovation between what was measured and what was estimated, as they would. A late, wrong or missing pose therefore
misleads the estimate just as it misleads a drone's, and nothing here knows the truth but through its sensors.

Covariance and noise as the firmware's extended Kalman filter (estimator_kalman.c, kalman_core.c, parameters kalman.*),
reduced to nine states: position, attitude, velocity (world frame).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from deploy.radio.simulated.interface import PoseMeasurement, Vec3
from deploy.radio.simulated.physics import algebra
from deploy.radio.simulated.physics.algebra import Index
from deploy.radio.simulated.physics.rigid_body import RigidBodies
from deploy.radio.simulated.physics.tuning import Tuning
from missions.arrays import Array, frozen

# Noise of process and gyro, kalman.*, with the firmware's defaults [m/s², m/s, m, rad, rad/s], and how far [m] and how
# fast [m/s] an estimate may be before the filter starts again. Noise is added every millisecond (estimator_kalman.c:
# "every loop, rather than every prediction"), so the sum over a tick is smaller than one step of it would be.
_DEFAULTS = {
    "pNAcc_xy": 0.5, "pNAcc_z": 1.0, "pNVel": 0.0, "pNPos": 0.0, "pNAtt": 0.0,
    "mNGyro_rollpitch": 0.1, "mNGyro_yaw": 0.1, "maxPos": 100.0, "maxVel": 10.0,
}  # fmt: skip
_LOOP = 0.001  # [s]
# kalman_core.c: stdDevInitialPosition_*, stdDevInitialVelocity, stdDevInitialAttitude_*.
_INITIAL_DEVIATION = frozen([0.01, 0.01, 0.01, 100.0, 100.0, 1.0, 0.01, 0.01, 0.01])
_LEAST, _MOST = 1e-6, 100.0**2  # MIN_COVARIANCE, MAX_COVARIANCE
_NOBODY = np.zeros(0, dtype=np.intp)
_UNMEASURED = 1e6  # standard deviation that makes an attitude measurement have no effect


class Estimates(NamedTuple):
    """What N drones believe of themselves.

    Attributes:
        position, velocity: (N, 3) [m], [m/s].
        rotation: (N, 3, 3) attitudes, body to world.
        misalignment: (N, 3, 3) what the true attitude has to be multiplied with, from the left, to give ``rotation``.
        motion: (N, 6) position and velocity side by side.
    """

    position: Array
    velocity: Array
    rotation: Array
    misalignment: Array
    motion: Array


class Estimators:
    """Errors and covariances of N filters.

    Attributes:
        position_error, velocity_error: (N, 3) estimate minus truth, world frame.
        rotation_error: (N, 4) D as quaternions, (N, 3, 3) in ``matrix``; both as of the last :meth:`estimates`.
        covariance: (N, 9, 9) what the filter believes of its own error: attitude, position, velocity. What can be
            measured comes first, so that the measured blocks are plain views.
    """

    def __init__(self, n: int) -> None:
        self._error = np.zeros((n, 6))
        self.position_error, self.velocity_error = self._error[:, :3], self._error[:, 3:]
        self.rotation_error = np.tile([0.0, 0.0, 0.0, 1.0], (n, 1))
        self.matrix = np.tile(np.eye(3), (n, 1, 1))
        self.covariance = np.tile(np.diag(_INITIAL_DEVIATION**2), (n, 1, 1))
        self._diagonal = self.covariance.reshape(n, 81)[:, ::10]
        self._transition = np.tile(np.eye(9), (n, 1, 1))
        self._dt = 0.0
        self._turned = False  # errors of attitude are not of unit length, or newer than their matrices
        self._parameters = {name: np.full(n, value) for name, value in _DEFAULTS.items()}
        self._tuning = Tuning({"kalman." + name: column for name, column in self._parameters.items()})
        self._tuned()

    def tune(self, index: int, changed: Mapping[str, float]) -> None:
        """Take one drone's parameters kalman.* that differ from the defaults."""
        if self._tuning.put(index, changed):
            self._tuned()

    @property
    def variances(self) -> Array:
        """(N, 9) variances of attitude, position, velocity."""
        return self._diagonal

    def estimates(self, bodies: RigidBodies) -> Estimates:
        """What the drones believe, given the truth."""
        if self._turned:
            self.rotation_error = algebra.normalised(self.rotation_error)
            # A new array: estimates that were given out share the one before.
            self.matrix = algebra.rotation_matrices(self.rotation_error)
            self._turned = False
        motion = bodies.motion + self._error
        return Estimates(motion[:, :3], motion[:, 3:], np.matmul(self.matrix, bodies.rotation), self.matrix, motion)

    def reset(self, index: int, position: Array, velocity: Array, quaternion: Array, to: tuple[Vec3, float]) -> None:
        """Start one filter at rest at a position and heading ``to``; the other arguments are the drone's truth.

        What is no number counts as zero, here and in nothing else (the firmware's filter would be lost from the start).
        """
        to = ((0.0, 0.0, 0.0), 0.0) if not math.isfinite(sum(to[0]) + to[1]) else to
        self.position_error[index] = np.asarray(to[0]) - position
        self.velocity_error[index] = -velocity
        level = algebra.yaw_quaternions(np.array([to[1]]))
        self.rotation_error[index] = algebra.multiply(level, algebra.conjugate(quaternion[None]))[0]
        self._turned = True
        self.covariance[index] = np.diag(_INITIAL_DEVIATION**2)

    def predict(self, force: Array, felt: Array, turn: Array, dt: float) -> None:
        """One prediction of dt.

        Args:
            force: (N, 3) true specific force, mean over dt, world frame [m/s²].
            felt: (N, 3) the same as the filter takes it from the accelerometers, turned by the estimated attitude.
            turn: (N, 3) gyro error, mean over dt, turned by the estimated attitude [rad/s].
            dt: [s].
        """
        change = felt - force
        self.position_error += dt * self.velocity_error
        change *= dt
        self.velocity_error += change
        change *= 0.5 * dt
        self.position_error += change
        self.rotation_error = self.rotation_error + _turns(dt * turn, self.rotation_error)
        self._turned = True
        f = self._transition
        if dt != self._dt:
            self._dt = dt
            f[:, [3, 4, 5], [6, 7, 8]] = dt
        f[:, 6:9, :3] = algebra.skew(-dt * felt)
        np.matmul(np.matmul(f, self.covariance), f.transpose(0, 2, 1), out=self.covariance)
        self._diagonal += self._noise * (dt / _LOOP)

    def correct(self, measured: Sequence[tuple[int, PoseMeasurement]], bodies: RigidBodies) -> None:
        """Take at most one pose per drone: (drone, measurement) pairs; the bodies are the truth."""
        index = np.array([i for i, _ in measured])
        rows = np.array([_row(m) for _, m in measured])
        believed = self.rotation_error.take(index, 0)
        estimated = algebra.multiply(believed, bodies.quaternion.take(index, 0))
        innovation = np.empty((len(rows), 6))
        np.subtract(rows[:, :3], (bodies.motion + self._error).take(index, 0)[:, :3], out=innovation[:, 3:])
        difference = algebra.multiply(rows[:, 3:7], algebra.conjugate(estimated))
        # As a rotation vector, to first order as in the firmware (mm_pose.c) but bounded for large angles.
        length = np.sqrt(np.add.reduce(difference * difference, 1, keepdims=True))
        np.multiply(difference[:, :3], np.copysign(2.0, difference[:, 3:]) / length, out=innovation[:, :3])
        noise = rows[:, 7:]
        if not math.isfinite(np.add.reduce(innovation + noise, None)):
            usable = np.isfinite(innovation).all(axis=1) & np.isfinite(rows).all(axis=1)
            self._correct_by_numbers(measured, usable, bodies)
            return
        self._update(index, innovation, noise, believed)

    def _correct_by_numbers(
        self, measured: Sequence[tuple[int, PoseMeasurement]], usable: NDArray[np.bool_], bodies: RigidBodies
    ) -> None:
        """Take the poses that are numbers; who was sent another is lost (hardware stays so until its next reset)."""
        good = []
        for pair, is_number in zip(measured, usable, strict=True):
            if is_number:
                good.append(pair)
            else:
                self.position_error[pair[0]] = np.nan
        if good:
            self.correct(good, bodies)

    def lost(self, state: Estimates) -> Index:
        """Indices of filters that left the allowed range, or the numbers; the firmware would reset the former."""
        if np.maximum.reduce(np.abs(state.motion), None) <= self._nearest:
            return _NOBODY
        far, fast = np.abs(state.position), np.abs(state.velocity)
        limits = self._parameters["maxPos"], self._parameters["maxVel"]
        return np.flatnonzero(~((far <= limits[0][:, None]) & (fast <= limits[1][:, None])).all(axis=1))

    def _tuned(self) -> None:
        """What a loop of the firmware adds to the covariance (kalman_core.c, addProcessNoiseDt)."""
        p, dt = self._parameters, _LOOP
        self._nearest = float(np.minimum(p["maxPos"], p["maxVel"]).min())  # [m] or [m/s]: nobody is lost below
        acceleration = np.stack([p["pNAcc_xy"], p["pNAcc_xy"], p["pNAcc_z"]], axis=1)
        gyro = np.stack([p["mNGyro_rollpitch"], p["mNGyro_rollpitch"], p["mNGyro_yaw"]], axis=1)
        position, velocity, attitude = (p[name][:, None] for name in ("pNPos", "pNVel", "pNAtt"))
        deviations = (
            gyro * dt + attitude,
            acceleration * dt * dt + velocity * dt + position,
            acceleration * dt + velocity,
        )
        noise = np.concatenate(deviations, axis=1) ** 2
        # Parameters are what clients make them: with noise that is no number, or endless, S could not be inverted.
        self._noise = np.minimum(np.nan_to_num(noise, nan=0.0), _MOST)

    def _update(self, index: Index, innovation: Array, noise: Array, believed: Array) -> None:
        """Kalman update of K drones.

        Args:
            index: (K,) which.
            innovation: (K, 6) of attitude and position.
            noise: (K, 6) their variances.
            believed: (K, 4) errors of attitude before.
        """
        p = self.covariance.take(index, 0)
        seen = p[:, :6].copy()  # H P
        s = p[:, :6, :6].copy()
        s.reshape(-1, 36)[:, ::7] += noise  # the diagonals
        weights = np.linalg.solve(s, seen)  # S⁻¹ H P: the gain's transpose, S being symmetric
        step = np.matmul(innovation[:, None, :], weights)[:, 0]
        self._error[index] += step[:, 3:]
        self.rotation_error[index] = believed + _turns(step[:, :3], believed)
        self._turned = True
        p -= np.matmul(p[:, :, :6], weights)
        p = p + p.transpose(0, 2, 1)
        p *= 0.5
        diagonal = p.reshape(-1, 81)[:, ::10]
        np.minimum(np.maximum(diagonal, _LEAST, out=diagonal), _MOST, out=diagonal)
        self.covariance[index] = p


def _turns(rotation: Array, q: Array) -> Array:
    """What to add to attitudes (N, 4) to turn them by rotation vectors (N, 3), world frame, up to their length.

    Cayley's map, exact to second order.
    """
    half = np.zeros((len(rotation), 4))
    np.multiply(rotation, 0.5, out=half[:, :3])
    return algebra.multiply(half, q)


def _row(m: PoseMeasurement) -> tuple[float, ...]:
    """Position, attitude, and variances of attitude and position; who measured no attitude did so very badly."""
    position = m.std_position * m.std_position
    if m.quaternion is None:
        attitude = _UNMEASURED * _UNMEASURED
        return (*m.position, 0.0, 0.0, 0.0, 1.0, attitude, attitude, attitude, position, position, position)
    attitude = m.std_quaternion * m.std_quaternion
    return (*m.position, *m.quaternion, attitude, attitude, attitude, position, position, position)
