"""Points of a degree-7 polynomial in x, y, z and yaw, as the firmware evaluates it (pptraj.c): float32 throughout.

Several times are evaluated together: one array call costs as much for fifty points as for one. Goals at K times are one
block (16, K): position, velocity, acceleration, jerk (three rows each), yaw, body rates, in the units of
:class:`Evaluation`.

Reference: D. Mellinger, V. Kumar, "Minimum snap trajectory generation and control for quadrotors", ICRA 2011: body
rates follow from acceleration, jerk and yaw because the quadrotor is differentially flat.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from deploy.radio.simulated.interface import ZERO, Vec3
from missions.arrays import Array

Float32 = NDArray[np.float32]

GRAVITY = 9.81  # [m/s²], the constant of the firmware's flatness map
_AXES, _TERMS, _DERIVATIVES = 4, 8, 4
ROWS = 16


class Evaluation(NamedTuple):
    """Goal of the planner at one time. World frame.

    Attributes:
        position, velocity, acceleration, jerk: [m], [m/s], [m/s²], [m/s³].
        yaw: [rad], not wrapped.
        omega: body rates [rad/s].
    """

    position: Vec3
    velocity: Vec3 = ZERO
    acceleration: Vec3 = ZERO
    jerk: Vec3 = ZERO
    yaw: float = 0.0
    omega: Vec3 = ZERO

    @classmethod
    def of(cls, goals: Array, k: int = 0) -> Evaluation:
        """The goal at the time of column ``k`` of a block."""
        x, y, z, vx, vy, vz, ax, ay, az, jx, jy, jz, yaw, p, q, r = goals[:, k].tolist()
        return cls((x, y, z), (vx, vy, vz), (ax, ay, az), (jx, jy, jz), yaw, (p, q, r))

    def repeated(self, count: int) -> Array:
        """A block of ``count`` times the same goal."""
        row = (*self.position, *self.velocity, *self.acceleration, *self.jerk, self.yaw, *self.omega)
        return np.tile(np.array(row)[:, None], (1, count))

    def is_valid(self) -> bool:
        """False when the position is not a number (the planner then has no goal)."""
        x, y, z = self.position
        return x == x and y == y and z == z  # NaN is not equal to itself


class Polynomial:
    """Four polynomials in ascending powers, prepared for evaluation together with three derivatives.

    Args:
        coefficients: (4, 8) float32; x, y, z [m], yaw [rad] over seconds.
    """

    def __init__(self, coefficients: Float32) -> None:
        rows = np.zeros((_DERIVATIVES, _AXES, _TERMS), np.float32)
        rows[0] = coefficients
        powers = np.arange(1, _TERMS, dtype=np.float32)
        for order in range(1, _DERIVATIVES):
            rows[order, :, :-1] = rows[order - 1, :, 1:] * powers
        flat = rows.reshape(_DERIVATIVES * _AXES, _TERMS)
        self._descending = [np.ascontiguousarray(flat[:, k : k + 1]) for k in range(_TERMS - 1, -1, -1)]

    def evaluate(self, t: np.float32, sign: int = 1) -> Evaluation:
        """Value at ``t`` seconds; ``sign`` -1 flips odd derivatives (a trajectory flown backwards)."""
        return Evaluation.of(self.evaluate_all(np.array([t], np.float32), sign))

    def evaluate_all(self, t: Float32, sign: int = 1) -> Array:
        """Goals (16, K) at the times ``t`` (K,) [s]."""
        with np.errstate(all="ignore"):  # clients may send anything; the firmware's floats do not trap either
            value: Float32 = np.repeat(self._descending[0], len(t), axis=1)
            for coefficient in self._descending[1:]:  # Horner
                value *= t
                value += coefficient
            if sign < 0:
                value.reshape(_DERIVATIVES, -1)[1::2] *= -1.0
            block = value.astype(np.float64).reshape(_DERIVATIVES, _AXES, -1)
            goals = np.empty((ROWS, len(t)))
            goals[:12] = block[:, :3].reshape(12, -1)
            goals[12] = block[0, 3]
            goals[13:] = body_rates(block[2, :3], block[3, :3], block[0, 3], block[1, 3])
        return goals


def body_rates(acceleration: Array, jerk: Array, yaw: Array, yaw_rate: Array) -> Array:
    """Body rates (3, K) [rad/s] by differential flatness (Mellinger and Kumar 2011, section III).

    Args:
        acceleration: (3, K) [m/s²], world frame.
        jerk: (3, K) [m/s³], world frame.
        yaw: (K,) [rad].
        yaw_rate: (K,) [rad/s].
    """
    ax, ay, az = acceleration[0], acceleration[1], acceleration[2] + GRAVITY
    thrust = np.sqrt(ax * ax + ay * ay + az * az)
    zx, zy, zz = ax / thrust, ay / thrust, az / thrust  # body z in the world frame
    cos_yaw, sin_yaw = np.cos(yaw), np.sin(yaw)
    yx, yy, yz = -zz * sin_yaw, zz * cos_yaw, zx * sin_yaw - zy * cos_yaw  # z_body × x_heading
    length = np.sqrt(yx * yx + yy * yy + yz * yz)
    yx, yy, yz = yx / length, yy / length, yz / length
    xx, xy, xz = yy * zz - yz * zy, yz * zx - yx * zz, yx * zy - yy * zx  # y_body × z_body
    # The part of the jerk along z_body drops out of both products below: x_body and y_body are orthogonal to it.
    jx, jy, jz = jerk[0] / thrust, jerk[1] / thrust, jerk[2] / thrust
    rates = np.stack([-(jx * yx + jy * yy + jz * yz), jx * xx + jy * xy + jz * xz, zz * yaw_rate])
    defined = (thrust > 0.0) & (thrust < math.inf) & (length != 0.0)
    return np.where(defined, rates, 0.0)


def stretch_time(coefficients: Float32, factor: np.float32) -> Float32:
    """Coefficients (4, 8) of the same curve flown ``factor`` times slower, multiplied up as the firmware does."""
    reciprocal = np.float32(1.0) / factor
    scale = np.cumprod(np.full(_TERMS - 1, reciprocal, np.float32), dtype=np.float32)
    stretched = coefficients.copy()
    stretched[:, 1:] *= scale
    return stretched


def normalize_angle(angle: float) -> float:
    """The same angle in [-π, π] [rad]."""
    return math.atan2(math.sin(angle), math.cos(angle)) if math.isfinite(angle) else math.nan


def rest_to(duration: np.float32, start: Float32, end: Float32) -> Float32:
    """Degree-7 coefficients (4, 8) between two states, with zero jerk at both ends (firmware ``poly7_nojerk``).

    Args:
        duration: T [s]; zero or less gives the end state at once.
        start: (3, 4) float32: value, first and second derivative of x, y, z, yaw at 0.
        end: (3, 4) float32: the same at T.
    """
    out = np.zeros((_AXES, _TERMS), np.float32)
    x0, dx0, ddx0 = start
    xf, dxf, ddxf = end
    if duration <= 0.0:
        out[:, 0], out[:, 1], out[:, 2] = xf, dxf, ddxf / 2
        return out
    T = duration
    T2 = T * T
    T4 = T2 * T * T
    T5, T6 = T4 * T, T4 * T * T
    T7 = T6 * T
    out[:, 0], out[:, 1], out[:, 2] = x0, dx0, ddx0 / 2
    out[:, 4] = -(5 * (14 * x0 - 14 * xf + 8 * T * dx0 + 6 * T * dxf + 2 * T2 * ddx0 - T2 * ddxf)) / (2 * T4)
    out[:, 5] = (84 * x0 - 84 * xf + 45 * T * dx0 + 39 * T * dxf + 10 * T2 * ddx0 - 7 * T2 * ddxf) / T5
    out[:, 6] = -(140 * x0 - 140 * xf + 72 * T * dx0 + 68 * T * dxf + 15 * T2 * ddx0 - 13 * T2 * ddxf) / (2 * T6)
    out[:, 7] = (2 * (10 * x0 - 10 * xf + 5 * T * dx0 + 5 * T * dxf + T2 * ddx0 - T2 * ddxf)) / T7
    return out
