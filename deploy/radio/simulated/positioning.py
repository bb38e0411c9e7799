"""Where simulated drones get their position from when no client sends it: a deck on board, or motion capture.

Without either the estimators drift, as on hardware that nobody tells where it is.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np

from deploy.radio.simulated.crazyflie import SimulatedCrazyflie
from deploy.radio.simulated.interface import PoseMeasurement
from deploy.radio.simulated.physics.world import World
from mocap.source import MocapSource

# Size of what a Lighthouse deck's measurements amount to (estimate; jitter as in Taffanel et al. 2021, "Lighthouse
# positioning system: dataset, accuracy, and precision for UAV research"). Idealised: no base stations, no shadows.
_RATE = 50.0  # [Hz]
_JITTER, _TURN = 0.002, 0.005  # [m], [rad] standard deviation an axis
_ASSUMED = (0.01, 0.02)  # [m], [rad] what the filter is told
_POSE = struct.Struct("<Bfffffff")
_POSE_HEADER, _POSE_TYPE = 0x61, 0x08


class OnboardPositioning:
    """Every drone measures its own pose with a deck; clients have nothing to do.

    Args:
        world: where the drones truly are. drones: in the world's order. seed: of the noise.
    """

    def __init__(self, world: World, drones: Sequence[SimulatedCrazyflie], seed: int = 0) -> None:
        self._world, self._drones = world, tuple(drones)
        self._rng = np.random.default_rng(seed)
        world.every(1.0 / _RATE, self._measure)

    def _measure(self, t: float) -> None:
        n = len(self._drones)
        position = self._world.positions + _JITTER * self._rng.standard_normal((n, 3))
        x, y, z, w = self._world.quaternions.T
        hx, hy, hz = 0.5 * _TURN * self._rng.standard_normal((3, n))
        # The true attitude after a small rotation; the filter normalises.
        attitude = np.stack(
            [x + hx * w + hy * z - hz * y, y - hx * z + hy * w + hz * x, z + hx * y - hy * x + hz * w, w], axis=1
        )
        for drone, p, q in zip(self._drones, position.tolist(), attitude.tolist(), strict=True):
            drone.sense(PoseMeasurement((p[0], p[1], p[2]), (q[0], q[1], q[2], q[3]), *_ASSUMED))


class MocapRelay:
    """A motion-capture computer that sends every drone its pose as cflib's ``extpos.send_extpose`` would.

    Args:
        mocap: who sees the drones. drones: with their rigid bodies' names.
    """

    def __init__(self, mocap: MocapSource, drones: Sequence[tuple[str, SimulatedCrazyflie]]) -> None:
        self._mocap, self._drones = mocap, tuple(drones)

    def send(self) -> None:
        """Pass on what has arrived since the last call."""
        for frame in self._mocap.poll():
            for body, drone in self._drones:
                pose = frame.bodies.get(body)
                if pose is not None and pose.quaternion is not None:
                    drone.receive(_POSE_HEADER, _POSE.pack(_POSE_TYPE, *pose.position, *pose.quaternion))
