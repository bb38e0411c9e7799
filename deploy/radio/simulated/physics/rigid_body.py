"""Rigid bodies under thrust, torque and slow forces; all drones in one step.

Newton-Euler with principal inertia, integrated by semi-implicit Euler: velocities first, then poses with the new
velocities. At 2 ms its error on a flight is far below the sensors' noise (tests compare with finer steps).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from deploy.radio.simulated.physics import algebra
from deploy.radio.simulated.physics.algebra import GRAVITY, Index
from missions.airframes import Airframe
from missions.arrays import Array


class RigidBodies:
    """True state of all bodies.

    Attributes:
        position, velocity: (N, 3) [m], [m/s], world frame, z up.
        quaternion: (N, 4) x, y, z, w, body to world.
        rotation: (N, 3, 3) the same as matrices.
        rates: (N, 3) angular velocity in the body frame [rad/s].
    """

    def __init__(self, airframes: Sequence[Airframe], positions: Array, yaws: Array, dt: float) -> None:
        n = len(airframes)
        self._dt = dt
        self.position = positions.astype(np.float64, copy=True)
        self.velocity = np.zeros((n, 3))
        self.quaternion = algebra.yaw_quaternions(yaws)
        self.rotation = algebra.rotation_matrices(self.quaternion)
        # x y z x y: the gyroscopic term's two factors are then plain views of one buffer.
        self._spin = np.zeros((n, 5))
        self.rates = self._spin[:, :3]
        self._gyroscopic = dt * np.array([_gyroscopic(a) for a in airframes])
        self._drag_per_mass = np.array([a.drag for a in airframes]) / np.array([[a.mass] for a in airframes])
        self._slow = np.zeros((n, 3))
        self._rate_map = dt * algebra.RATE

    def refresh(self, extra: Array) -> None:
        """Once a control tick: unit quaternions again, and the forces that hardly change in between.

        Args:
            extra: (N, 3) accelerations from outside [m/s²], e.g. downwash; gravity and drag are added here.
        """
        self.quaternion = algebra.normalised(self.quaternion)
        self.rotation = algebra.rotation_matrices(self.quaternion)
        body_velocity = np.matmul(self.velocity[:, None, :], self.rotation)  # (N, 1, 3): Rᵀ v as a row
        drag = np.matmul(self.rotation, (self._drag_per_mass * body_velocity[:, 0])[:, :, None])[:, :, 0]
        self._slow = self._dt * (extra - drag)
        self._slow[:, 2] -= self._dt * GRAVITY

    def step(self, accelerations: Array) -> None:
        """Advance by dt under rotor accelerations (N, 4), see ``Rotors.accelerations``."""
        spin, dt = self._spin, self._dt
        self.velocity += self.rotation[:, :, 2] * (dt * accelerations[:, :1])
        self.velocity += self._slow
        self.position += dt * self.velocity
        turn = self._gyroscopic * (spin[:, 1:4] * spin[:, 2:5])
        self.rates += dt * accelerations[:, 1:]
        self.rates += turn
        spin[:, 3:] = spin[:, :2]
        outer = self.quaternion[:, :, None] * spin[:, None, :3]
        self.quaternion += outer.reshape(-1, 12).dot(self._rate_map)
        self.rotation = algebra.rotation_matrices(self.quaternion)

    def stop_spin(self, index: Index) -> None:
        """Take all rotation out of some bodies (ground contact)."""
        self._spin[index] = 0.0


def _gyroscopic(airframe: Airframe) -> tuple[float, float, float]:
    """Factors of ωy ωz, ωz ωx, ωx ωy in Euler's equations."""
    jx, jy, jz = airframe.inertia
    return (jy - jz) / jx, (jz - jx) / jy, (jx - jy) / jz
