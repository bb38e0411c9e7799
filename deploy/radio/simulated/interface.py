"""What a simulated Crazyflie's firmware and the simulated world say to each other, every 10 ms.

The world owns the bodies (true state, motors, sensors, estimator, controllers, all drones at once); the firmware owns
everything a client can see through packets (parameters, log, memory, commander, supervisor). World frame, SI units,
quaternions x, y, z, w (body to world).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple, Protocol

from missions.arrays import Array

PERIOD = 0.01  # [s] between ticks
Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]
ZERO: Vec3 = (0.0, 0.0, 0.0)
_AT_REST = 0.05  # [m/s]


class SetpointMode(Enum):
    """What of a setpoint the controller has to follow."""

    OFF = "motors off"
    FULL = "position, velocity, acceleration, jerk and yaw (high-level commander, full state)"
    POSITION = "position and yaw"
    VELOCITY = "velocity and yaw rate"
    HOVER = "x, y velocity in the body frame, absolute z, yaw rate"
    ATTITUDE = "roll, pitch, yaw rate and thrust"
    HEIGHT = "roll, pitch, yaw rate and absolute z"
    CLIMB = "roll, pitch, yaw rate and z velocity"
    RATES = "body rates and thrust"


class Setpoint(NamedTuple):
    """What the commander asks of the controller.

    Attributes:
        mode: which of the other fields count.
        position, velocity, acceleration, jerk: [m], [m/s], [m/s²], [m/s³].
        yaw: [rad]. omega: body rates [rad/s] (fed forward by FULL, wanted by RATES; else [2] is the yaw rate).
        attitude: roll, pitch [rad]. thrust: 0..65535, of ATTITUDE and RATES.
    """

    mode: SetpointMode = SetpointMode.OFF
    position: Vec3 = ZERO
    velocity: Vec3 = ZERO
    acceleration: Vec3 = ZERO
    jerk: Vec3 = ZERO
    yaw: float = 0.0
    omega: Vec3 = ZERO
    attitude: tuple[float, float] = (0.0, 0.0)
    thrust: float = 0.0

    def is_finite(self) -> bool:
        """Whether every number in it is one."""
        vectors = self.position + self.velocity + self.acceleration + self.jerk + self.omega + self.attitude
        return math.isfinite(sum(vectors) + self.yaw + self.thrust)


class PoseMeasurement(NamedTuple):
    """An external position or pose as it arrived over the radio."""

    position: Vec3
    quaternion: Quat | None
    std_position: float = 0.01
    std_quaternion: float = 0.0045


class Course(NamedTuple):
    """Setpoints (mode FULL) of a tick and of those after it: the world need not ask for each.

    Attributes:
        begin: world time of the first [s]; one every :data:`PERIOD`.
        goals: (16, K) position, velocity, acceleration, jerk, yaw, omega, in the units of :class:`Setpoint`.
    """

    begin: float
    goals: Array


class Orders(NamedTuple):
    """Firmware to world, valid until the next ones."""

    setpoint: Setpoint = Setpoint()
    motors_allowed: bool = False  # the supervisor's word; False cuts the motors whatever the setpoint says
    controller: int = 1  # stabilizer.controller: 1 PID, 2 Mellinger
    measurements: tuple[PoseMeasurement, ...] = ()  # since the last tick, oldest first
    reset_estimator: bool = False  # kalman.resetEstimation was set since the last tick
    initial_pose: tuple[Vec3, float] = (ZERO, 0.0)  # kalman.initialX/Y/Z, initialYaw: used by a reset
    # Parameters of controllers and estimator that are not the defaults, by name; the same object until one changes.
    tuning: Mapping[str, float] = MappingProxyType({})
    course: Course | None = None  # what the setpoint is part of; None: it stays as it is

    def hold_until(self, telemetry: Telemetry) -> float:
        """World time [s] until which they stay as they are if nothing happens; the past if they are for one tick."""
        if self.course is not None:
            return self.course.begin + PERIOD * len(self.course.goals[0])
        # At rest: where the drone is is where a plan would start, and that does not change.
        at_rest = self.setpoint.mode is SetpointMode.OFF and math.hypot(*telemetry.velocity) < _AT_REST
        return math.inf if at_rest else -math.inf


class Telemetry(NamedTuple):
    """World to firmware: what the drone knows of itself (not the truth)."""

    position: Vec3 = ZERO  # estimated
    velocity: Vec3 = ZERO  # estimated
    acceleration: Vec3 = ZERO  # estimated, world frame, without gravity [m/s²]
    quaternion: Quat = (0.0, 0.0, 0.0, 1.0)  # estimated
    gyro: Vec3 = ZERO  # body rates [rad/s]
    accelerometer: Vec3 = (0.0, 0.0, 1.0)  # specific force, body frame [g]
    variance_position: Vec3 = (1e-6, 1e-6, 1e-6)  # kalman.varX.. [m²]
    variance_velocity: Vec3 = (1e-6, 1e-6, 1e-6)  # kalman.varPX.. [m²/s²]
    motors: tuple[int, int, int, int] = (0, 0, 0, 0)  # commanded, 0..65535
    thrust: float = 0.0  # collective command, 0..65535 scale
    battery_voltage: float = 4.1  # under the present load [V]
    tumbled: bool = False  # upside down or on its side for long enough that the firmware would say so
    variance_attitude: Vec3 = (1e-6, 1e-6, 1e-6)  # kalman.varD0.. [rad²]
    asked_attitude: Vec3 = ZERO  # roll, pitch, yaw that the PID controller aims at, right-handed [deg]
    asked_rates: Vec3 = ZERO  # and body rates [deg/s]
    moments: Vec3 = ZERO  # commanded about body x, y, z, motor counts
    height: float = 0.0  # above the floor, as a barometer tells it [m]


class Firmware(Protocol):
    """What the world needs of a simulated Crazyflie."""

    def glance(self, t: float) -> tuple[PoseMeasurement, ...] | None:
        """It is world time t [s]: None to be given telemetry, else the orders hold, and this was measured meanwhile."""

    def tick(self, t: float, telemetry: Telemetry) -> Orders:
        """Run the 100 Hz work (log blocks, commander, supervisor) at world time t [s]; answer with orders."""
