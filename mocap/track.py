"""What is known of one robot's motion, and how far from that a pose can be."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]
_NOISE = 0.10  # m; far above any system's, and a third of what the closest robots keep
_UNSURE = 1.0  # m/s; error of the velocity while a robot turns
_AGILITY = 25.0  # m/s²; full thrust and gravity together
_SMOOTHING = 0.05  # s; time constant of the velocity
_SPIN, _TWIST = 35.0, 0.35  # rad/s (2000 °/s, what the gyroscopes measure), rad
_UPRIGHT = 0.8  # rad between a reported attitude and the robot's own word


class Word(NamedTuple):
    """What a robot says of itself: when (flight clock [s]), where [m], how fast [m/s], roll, pitch, yaw [rad]."""

    t: float
    position: Vec3
    velocity: Vec3
    rpy: Vec3


@dataclass
class Track:
    """What is known of one robot.

    Attributes:
        t: when it was believed last [s]. position, velocity: then [m], [m/s].
        attitude: last believed one, at ``turned`` [s]. refused: poses since then. askew: whether attitudes are refused.
        ghost: newest pose of those that began with a jump and went on from there, if the last one was such.
    """

    t: float
    position: Vec3
    velocity: Vec3 = (0.0, 0.0, 0.0)
    attitude: Quat | None = None
    turned: float = -math.inf
    refused: int = 0
    askew: bool = False
    ghost: tuple[float, Vec3] | None = None

    def predicted(self, t: float) -> Vec3:
        """Where it should be at t [m]."""
        return carried_on(self.position, self.velocity, t - self.t)

    def turn_off(self, attitude: Quat, t: float, word: Callable[[], Word | None]) -> float:
        """By how much an attitude is off at t [rad] if it is off by more than can be; else 0.

        Args:
            attitude: reported.
            t: when [s].
            word: asks for the robot's own; decides where the last attitude is too old to tell, or was refused.
        """
        allowed = _TWIST + _SPIN * (t - self.turned)
        if self.attitude is not None and allowed < math.pi and not self.askew:
            off = angle(attitude, self.attitude)
        elif (own := word()) is not None:
            off, allowed = angle(attitude, quaternion(own.rpy)), _UPRIGHT
        else:
            return math.pi if self.askew else 0.0
        return off if off > allowed else 0.0

    def move(self, position: Vec3, t: float) -> None:
        """Take a believed position that continues the last one."""
        dt = t - self.t
        share = 1.0 - math.exp(-dt / _SMOOTHING)
        (x, y, z), (a, b, c), (u, v, w), rate = position, self.position, self.velocity, share / dt
        velocity = u + rate * (x - a) - share * u, v + rate * (y - b) - share * v, w + rate * (z - c) - share * w
        self.restart(position, velocity, t)

    def restart(self, position: Vec3, velocity: Vec3, t: float) -> None:
        """Take a believed position, whatever was before."""
        self.t, self.position, self.velocity = t, position, velocity
        self.refused, self.ghost = 0, None


def carried_on(position: Vec3, velocity: Vec3, dt: float) -> Vec3:
    """Where constant velocity leads [m]."""
    # A thousand times a second with ten drones, as what follows: written out, for speed.
    return position[0] + velocity[0] * dt, position[1] + velocity[1] * dt, position[2] + velocity[2] * dt


def reach(dt: float) -> float:
    """How far from its predicted place a robot may be after so long [m]."""
    return _NOISE + _UNSURE * dt + 0.5 * _AGILITY * dt * dt


def angle(a: Quat, b: Quat) -> float:
    """Between two attitudes [rad]; the quaternions need not have unit length."""
    x, y, z, w = a
    p, q, r, s = b
    scale = math.sqrt((x * x + y * y + z * z + w * w) * (p * p + q * q + r * r + s * s))
    return 2.0 * math.acos(min(1.0, abs(x * p + y * q + z * r + w * s) / scale)) if scale else math.pi


def quaternion(rpy: Vec3) -> Quat:
    """x, y, z, w of roll, pitch, yaw [rad]: first roll, last yaw."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(0.5 * angle), math.sin(0.5 * angle)) for angle in rpy)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )
