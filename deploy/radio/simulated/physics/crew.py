"""The firmwares of all drones: who has to be told what, and what they ordered."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from deploy.radio.simulated.interface import Firmware, Orders, PoseMeasurement, Telemetry
from deploy.radio.simulated.physics.algebra import GRAVITY, Flags, multiply
from deploy.radio.simulated.physics.autopilot import Autopilots
from deploy.radio.simulated.physics.battery import Batteries
from deploy.radio.simulated.physics.estimator import Estimators
from deploy.radio.simulated.physics.rigid_body import RigidBodies
from missions.arrays import Array

Measured = Sequence[tuple[int, PoseMeasurement]]
Row = tuple[list[float], list[int], bool]


class Readings(NamedTuple):
    """Sensors of all drones in one tick.

    Attributes:
        force: (N, 3) accelerometers, body frame [m/s²].
        gyro_error: (N, 3) [rad/s], to be added to the true rates.
        acceleration: (N, 3) what the drones make of ``force``: world frame, with gravity [m/s²].
        tumbled: (N,) whether the firmware would say so.
    """

    force: Array
    gyro_error: Array
    acceleration: Array
    tumbled: Flags


class Crew:
    """N firmwares, in the order of the bodies."""

    def __init__(self, n: int) -> None:
        self._n = n
        self._firmwares: tuple[Firmware, ...] = ()
        self._orders = [Orders()] * n
        self._measured: list[tuple[int, tuple[PoseMeasurement, ...]]] = []

    def attach(self, firmwares: Sequence[Firmware]) -> None:
        """Take the firmwares.

        Raises:
            ValueError: not one firmware per drone.
        """
        if len(firmwares) != self._n:
            raise ValueError(f"a world of {self._n} drones takes {self._n} firmwares; got {len(firmwares)}")
        self._firmwares = tuple(firmwares)

    def consult(self, t: float, know: Callable[[], Sequence[Row]], obey: Callable[[int, Orders, Orders], None]) -> None:
        """Ask whoever has something to do at ``t`` [s].

        Args:
            t: world time.
            know: works out what the drones know of themselves, see :func:`knowledge`; called only if somebody asks.
            obey: carries out a drone's orders, given those before.
        """
        known: Sequence[Row] | None = None
        for i, firmware in enumerate(self._firmwares):
            measured = firmware.glance(t)
            if measured is None:
                known = know() if known is None else known
                order = firmware.tick(t, _telemetry(*known[i]))
                obey(i, order, self._orders[i])
                self._orders[i], measured = order, order.measurements
            if measured:
                self._measured.append((i, measured))

    def measurements(self) -> list[Measured]:
        """Poses that reached the drones since the last call: oldest first, at most one of each drone at a time."""
        if not self._measured:
            return []
        rounds = max(len(poses) for _, poses in self._measured)
        taken: list[Measured] = [
            [(i, poses[k]) for i, poses in self._measured if k < len(poses)] for k in range(rounds)
        ]
        self._measured.clear()
        return taken


def knowledge(
    readings: Readings,
    bodies: RigidBodies,
    estimators: Estimators,
    autopilots: Autopilots,
    batteries: Batteries,
) -> list[Row]:
    """What every drone knows of itself: the numbers of :class:`Telemetry`, motors and whether it has tumbled apart."""
    state = estimators.estimates(bodies)
    block = np.concatenate(
        [
            state.position,
            state.velocity,
            readings.acceleration,
            bodies.rates + readings.gyro_error,
            readings.force / GRAVITY,
            estimators.variances,
            multiply(estimators.rotation_error, bodies.quaternion),
            autopilots.asked,
            autopilots.moments,
            autopilots.thrust[:, None],
            batteries.voltage[:, None],
            bodies.position[:, 2:],
        ],
        axis=1,
    )
    block[:, 8] -= GRAVITY
    motors = autopilots.command.astype(np.int64)
    return list(zip(block.tolist(), motors.tolist(), readings.tumbled.tolist(), strict=True))


def _telemetry(row: list[float], motors: list[int], tumbled: bool) -> Telemetry:
    x, y, z, vx, vy, vz, ax, ay, az, p, q, r, gx, gy, gz = row[:15]
    dx, dy, dz, px, py, pz, sx, sy, sz, qx, qy, qz, qw = row[15:28]
    roll, pitch, yaw, rx, ry, rz, mx, my, mz, thrust, volt, height = row[28:]
    m1, m2, m3, m4 = motors
    return Telemetry(
        (x, y, z),
        (vx, vy, vz),
        (ax, ay, az),
        (qx, qy, qz, qw),
        (p, q, r),
        (gx, gy, gz),
        (px, py, pz),
        (sx, sy, sz),
        (m1, m2, m3, m4),
        thrust,
        volt,
        tumbled,
        (dx, dy, dz),
        (roll, pitch, yaw),
        (rx, ry, rz),
        (mx, my, mz),
        height,
    )
