"""What the drones tell of themselves: log blocks, and the records made of them.

A log block is at most 26 bytes and, to fit into one create packet, at most 9 variables (log.c; with more, cflib
ignores errors of the second packet). Quantities that only need three digits travel as half floats.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from deploy.radio.supervisor import Supervisor

Vec3 = tuple[float, float, float]
TICK_WRAP = 1 << 24  # the drone's millisecond stamp has 24 bits

# block: ((variable, type it is fetched as; "" for the type it is stored as), ...)
BLOCKS: Mapping[str, tuple[tuple[str, str], ...]] = {
    "estimate": (
        *((f"stateEstimate.{axis}", "float") for axis in ("x", "y", "z")),
        *((f"stateEstimate.{axis}", "FP16") for axis in ("vx", "vy", "vz", "roll", "pitch", "yaw")),
    ),
    "setpoint": (
        *((f"ctrltarget.{axis}", "float") for axis in ("x", "y", "z")),
        *((f"ctrltarget.{axis}", "FP16") for axis in ("vx", "vy", "vz", "yaw")),
    ),
    "status": (
        *(("pm.vbat", "float"), ("pm.batteryLevel", ""), ("pm.state", ""), ("supervisor.info", "uint16_t")),
        *((f"motor.m{k}", "uint16_t") for k in (1, 2, 3, 4)),
    ),
    "variance": (*((f"kalman.{axis}", "float") for axis in ("varX", "varY", "varZ", "varPX", "varPY", "varPZ")),),
}


class Sample(NamedTuple):
    """One log packet.

    Attributes:
        block: key of :data:`BLOCKS`.
        t: flight time it arrived at [s]. tick: drone's own clock [ms since boot], unwrapped.
        values: by variable name, in the firmware's units (degrees for angles).
    """

    block: str
    t: float
    tick: int
    values: Mapping[str, float]

    def vector(self, group: str, names: tuple[str, str, str]) -> Vec3:
        """Three of the values."""
        a, b, c = names
        values = self.values
        return values[f"{group}.{a}"], values[f"{group}.{b}"], values[f"{group}.{c}"]


class Estimate(NamedTuple):
    """The drone's own estimate: position [m], velocity [m/s] (world), roll, pitch, yaw [rad]."""

    t: float
    tick: int
    position: Vec3
    velocity: Vec3
    rpy: Vec3


class Target(NamedTuple):
    """What the commander asks of the controller: position [m], velocity [m/s], yaw rate [rad/s].

    No log variable says which heading is asked for: ``ctrltarget.yaw`` is a rate (stabilizer.c, attitudeRate.yaw).
    """

    t: float
    tick: int
    position: Vec3
    velocity: Vec3
    yaw_rate: float


class Status(NamedTuple):
    """Battery [V, 0..100 %, firmware power state], supervisor, and what each motor is commanded (0..65535)."""

    t: float
    tick: int
    voltage: float
    level: float
    power_state: int
    supervisor: Supervisor
    motors: tuple[int, int, int, int]

    @property
    def battery_low(self) -> bool:
        """Firmware power states 3 (low power) and 4 (shut down), pm.h."""
        return self.power_state >= 3


class Variance(NamedTuple):
    """Kalman filter variances: position [m²], velocity [m²/s²]."""

    t: float
    tick: int
    position: Vec3
    velocity: Vec3


Record = Estimate | Target | Status | Variance


def unwrap(tick: int, previous: int) -> int:
    """Continue a 24-bit millisecond count past its wrap; samples of different blocks may be slightly out of order."""
    return previous + (tick - previous + TICK_WRAP // 2) % TICK_WRAP - TICK_WRAP // 2


def to_record(sample: Sample) -> Record:
    """Give a log packet its units."""
    t, tick, values = sample.t, sample.tick, sample.values
    if sample.block == "estimate":
        roll, pitch, yaw = sample.vector("stateEstimate", ("roll", "pitch", "yaw"))
        # The firmware's legacy coordinate system counts pitch the other way round (stateEstimate.pitch).
        rpy = (math.radians(roll), -math.radians(pitch), math.radians(yaw))
        position = sample.vector("stateEstimate", ("x", "y", "z"))
        return Estimate(t, tick, position, sample.vector("stateEstimate", ("vx", "vy", "vz")), rpy)
    if sample.block == "setpoint":
        position = sample.vector("ctrltarget", ("x", "y", "z"))
        velocity = sample.vector("ctrltarget", ("vx", "vy", "vz"))
        return Target(t, tick, position, velocity, math.radians(values["ctrltarget.yaw"]))
    if sample.block == "status":
        word = Supervisor(int(values["supervisor.info"]))
        level, state = float(values["pm.batteryLevel"]), int(values["pm.state"])
        m1, m2, m3, m4 = (int(values[f"motor.m{k}"]) for k in (1, 2, 3, 4))
        return Status(t, tick, float(values["pm.vbat"]), level, state, word, (m1, m2, m3, m4))
    position = sample.vector("kalman", ("varX", "varY", "varZ"))
    return Variance(t, tick, position, sample.vector("kalman", ("varPX", "varPY", "varPZ")))
