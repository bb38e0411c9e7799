"""A world without physics, for tests of the firmware: bodies follow setpoints exactly and fall when motors stop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from deploy.radio.simulated.interface import Firmware, Orders, SetpointMode, Telemetry, Vec3

TICK = 0.01
SPIN_UP = 3  # ticks from the first setpoint to motors above idle


@dataclass
class IdealBody:
    """One drone that is where it is told to be."""

    position: Vec3 = (0.0, 0.0, 0.0)
    velocity: Vec3 = (0.0, 0.0, 0.0)
    yaw: float = 0.0
    running: bool = False
    tumbled: bool = False
    voltage: float = 4.0
    accelerometer: Vec3 = (0.0, 0.0, 1.0)
    orders: Orders = field(default_factory=Orders)
    ticks_running: int = 0

    def telemetry(self) -> Telemetry:
        level = 36000 if self.ticks_running > SPIN_UP else 0
        return Telemetry(
            position=self.position,
            velocity=self.velocity,
            quaternion=(0.0, 0.0, math.sin(self.yaw / 2), math.cos(self.yaw / 2)),
            accelerometer=self.accelerometer,
            motors=(level, level, level, level),
            battery_voltage=self.voltage,
            tumbled=self.tumbled,
        )

    def follow(self, orders: Orders) -> None:
        self.orders = orders
        setpoint = orders.setpoint
        self.running = orders.motors_allowed and setpoint.mode is not SetpointMode.OFF
        self.ticks_running = self.ticks_running + 1 if self.running else 0
        x, y, z = self.position
        if not self.running:
            self.position, self.velocity = (x, y, max(0.0, z - 0.05)), (0.0, 0.0, 0.0)
        elif setpoint.mode in (SetpointMode.FULL, SetpointMode.POSITION):
            self.position, self.velocity, self.yaw = setpoint.position, setpoint.velocity, setpoint.yaw


class IdealWorld:
    """Implements the world seam of ``deploy.radio.simulated.swarm``."""

    def __init__(self, positions: Sequence[Vec3]) -> None:
        self.bodies = [IdealBody(position) for position in positions]
        self.t = 0.0
        self._ticks = 0
        self._firmwares: Sequence[Firmware] = ()

    def attach(self, firmwares: Sequence[Firmware]) -> None:
        self._firmwares = firmwares
        self._tick()

    def advance(self, t: float) -> None:
        while (self._ticks + 1) * TICK <= t + 1e-9:
            self._ticks += 1
            self.t = self._ticks * TICK
            self._tick()

    def _tick(self) -> None:
        for body, firmware in zip(self.bodies, self._firmwares, strict=True):
            body.follow(firmware.tick(self.t, body.telemetry()))
