"""Rigid bodies under thrust, torque and slow forces; all drones in one step.

Newton-Euler with principal inertia, integrated by Euler's method: semi-implicit for the positions (velocities first),
explicit for the attitudes. At 5 ms its error on a flight is far below the sensors' noise (tests compare with finer
steps). Everything quadratic in attitude and rates comes from one product with a constant matrix, and results go into
buffers: at a handful of drones the number of array calls, not of operations, is what costs time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from deploy.radio.simulated.physics import algebra
from deploy.radio.simulated.physics.algebra import GRAVITY
from missions.airframes import Airframe
from missions.arrays import Array


class RigidBodies:
    """True state of all bodies.

    Attributes:
        position, velocity: (N, 3) [m], [m/s], world frame, z up; side by side in ``motion``.
        quaternion: (N, 4) x, y, z, w, body to world.
        rates: (N, 3) angular velocity in the body frame [rad/s].
        rotation: (N, 3, 3) the attitudes as matrices, as of the last :meth:`step` or :meth:`update`.
    """

    def __init__(self, airframes: Sequence[Airframe], positions: Array, yaws: Array, dt: float) -> None:
        n = len(airframes)
        self._dt = dt
        self.motion = np.zeros((n, 6))
        self.position, self.velocity = self.motion[:, :3], self.motion[:, 3:]
        self.position[:] = positions
        # Attitude and rates side by side: all that the equations of rotation need is quadratic in these seven numbers.
        self._spin = np.zeros((n, 7))
        self._quaternion, self._rates = self._spin[:, :4], self._spin[:, 4:]
        self._column, self._row = self._spin[:, :, None], self._spin[:, None, :]
        self._outer = np.zeros((n, 7, 7))
        self._outer_rows = self._outer.reshape(n, 49)
        self._map = algebra.QUADRATIC * np.repeat([dt, 1.0, 1.0], (4, 9, 3))
        self._terms = np.zeros((n, 16))
        self._turned, self._products = self._terms[:, :4], self._terms[:, 13:]
        self._rotation = self._terms[:, 4:13].reshape(n, 3, 3)
        self._up = self._rotation[:, :, 2]
        self._gyroscopic = dt * np.array([_gyroscopic(a) for a in airframes])
        self._drag = -dt * np.array([a.drag for a in airframes]) / np.array([[a.mass] for a in airframes])
        self._slow = np.zeros((n, 3))
        self._kick = np.zeros((n, 4))
        self._push, self._twist = self._kick[:, :1], self._kick[:, 1:]
        self._scratch = np.zeros((n, 3))
        self._quaternion[:] = algebra.yaw_quaternions(yaws)
        self.update()

    @property
    def quaternion(self) -> Array:
        """Attitudes; who writes into them calls :meth:`update`."""
        return self._quaternion

    @property
    def rates(self) -> Array:
        """Angular velocities; who writes into them calls :meth:`update`."""
        return self._rates

    @property
    def rotation(self) -> Array:
        """Attitudes as matrices; not to be written."""
        return self._rotation

    def update(self) -> None:
        """Take note of attitudes or rates that were written from outside."""
        np.multiply(self._column, self._row, out=self._outer)
        np.dot(self._outer_rows, self._map, out=self._terms)

    def refresh(self, lift: Array | None = None) -> None:
        """Once a control tick: unit quaternions again, and the forces that hardly change in between.

        Args:
            lift: (N,) upward accelerations from outside [m/s²], e.g. downwash; gravity and drag are added here.
        """
        q = self._quaternion
        q /= np.sqrt(np.add.reduce(q * q, 1, keepdims=True))
        self.update()
        drag = np.matmul(self.velocity[:, None, :], self._rotation)[:, 0]  # Rᵀ v as rows: velocity in the body frame
        drag *= self._drag
        np.matmul(self._rotation, drag[:, :, None], out=self._slow[:, :, None])
        self._slow[:, 2] -= self._dt * GRAVITY
        if lift is not None:
            self._slow[:, 2] += self._dt * lift

    def step(self, accelerations: Array) -> None:
        """Advance by dt under rotor accelerations (N, 4), see ``Rotors.accelerations``."""
        dt, scratch = self._dt, self._scratch
        np.multiply(accelerations, dt, out=self._kick)
        self.velocity += np.multiply(self._up, self._push, out=scratch)
        self.velocity += self._slow
        self.position += np.multiply(self.velocity, dt, out=scratch)
        self._quaternion += self._turned
        self._rates += self._twist
        self._rates += np.multiply(self._gyroscopic, self._products, out=scratch)
        self.update()


def _gyroscopic(airframe: Airframe) -> tuple[float, float, float]:
    """Factors of ωy ωz, ωz ωx, ωx ωy in Euler's equations."""
    jx, jy, jz = airframe.inertia
    return (jy - jz) / jx, (jz - jx) / jy, (jx - jy) / jz
