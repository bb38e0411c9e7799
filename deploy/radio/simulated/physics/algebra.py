"""Rotations of many bodies at once, with as few NumPy calls as possible.

Quaternions are rows x, y, z, w, body to world. A product of two quaternions is one outer product and one constant
matrix: at a handful of drones the number of calls, not of operations, is what costs time.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array, frozen

Index = NDArray[np.intp]
Flags = NDArray[np.bool_]

GRAVITY = 9.81  # [m/s²], the firmware's GRAVITY_MAGNITUDE


def _bilinear(terms: str, left: str, right: str) -> Array:
    """Constant matrix of a bilinear map: a row per pair of factors, a column per output (``+xw -yz ...`` in terms)."""
    outputs = terms.split(",")
    matrix = np.zeros((len(left) * len(right), len(outputs)))
    for column, output in enumerate(outputs):
        for term in output.split():
            row = left.index(term[1]) * len(right) + right.index(term[2])
            matrix[row, column] += 1.0 if term[0] == "+" else -1.0
    return frozen(matrix)


def _quadratic() -> Array:
    matrix = np.zeros((7, 7, 16))
    matrix[:4, 4:, :4] = RATE.reshape(4, 3, 4)
    matrix[:4, :4, 4:13] = _ROTATION.reshape(4, 4, 9)
    for k, (i, j) in enumerate(((5, 6), (6, 4), (4, 5))):
        matrix[i, j, 13 + k] = 1.0
    return frozen(matrix.reshape(49, 16))


_ROTATION = _bilinear(
    "+ww +xx -yy -zz, +xy +xy -zw -zw, +xz +xz +yw +yw,"
    "+xy +xy +zw +zw, +ww -xx +yy -zz, +yz +yz -xw -xw,"
    "+xz +xz -yw -yw, +yz +yz +xw +xw, +ww -xx -yy +zz",
    "xyzw",
    "xyzw",
)
_HAMILTON = _bilinear(
    "+wx +xw +yz -zy, +wy -xz +yw +zx, +wz +xy -yx +zw, +ww -xx -yy -zz",
    "xyzw",
    "xyzw",
)
_CROSS = _bilinear("+yz -zy, +zx -xz, +xy -yx", "xyz", "xyz")
_SKEW = frozen(np.array([[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0]]))
_CONJUGATE = frozen(np.array([-1.0, -1.0, -1.0, 1.0]))
RATE = frozen(0.5 * _HAMILTON.reshape(4, 4, 4)[:, :3].reshape(12, 4))
"""(12, 4): outer(q, body rates) times this is dq/dt."""

QUADRATIC = _quadratic()
"""(49, 16): outer(s, s) of s = (quaternion, body rates) times this is dq/dt (4 columns), the rotation matrix (9, row by
row) and the products of rates in Euler's equations, ωy ωz, ωz ωx, ωx ωy (3)."""


def rotation_matrices(q: Array) -> Array:
    """(N, 3, 3) body to world; scaled by |q|² when q is not quite of unit length."""
    n = len(q)
    out: Array = (q[:, :, None] * q[:, None, :]).reshape(n, 16).dot(_ROTATION).reshape(n, 3, 3)
    return out


def multiply(a: Array, b: Array) -> Array:
    """Hamilton products (N, 4): first b, then a."""
    out: Array = (a[:, :, None] * b[:, None, :]).reshape(len(a), 16).dot(_HAMILTON)
    return out


def conjugate(q: Array) -> Array:
    """Inverse rotations (N, 4)."""
    out: Array = q * _CONJUGATE
    return out


def normalised(v: Array) -> Array:
    """Rows of unit length; v must not have a zero row."""
    out: Array = v / np.sqrt(np.add.reduce(v * v, 1, keepdims=True))
    return out


def exponential(rotation: Array) -> Array:
    """Quaternions (N, 4) of rotation vectors (N, 3) [rad]."""
    out = np.empty((len(rotation), 4))
    half = 0.5 * np.sqrt(np.add.reduce(rotation * rotation, 1, keepdims=True))
    half = np.maximum(half, 1e-9)  # sin(x)/x without a special case: still exact there
    np.multiply(rotation, 0.5 * np.sin(half) / half, out=out[:, :3])
    np.cos(half, out=out[:, 3:])
    return out


def logarithm(q: Array) -> Array:
    """Rotation vectors (N, 3) [rad], the shorter way round, of unit quaternions (N, 4)."""
    q = np.where(q[:, 3:] < 0.0, -q, q)
    sine = np.sqrt((q[:, :3] * q[:, :3]).sum(axis=1, keepdims=True))
    angle = 2.0 * np.arctan2(sine, q[:, 3:])
    out: Array = q[:, :3] * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 2.0)
    return out


def cross(a: Array, b: Array) -> Array:
    """Row-wise cross products (N, 3)."""
    out: Array = (a[:, :, None] * b[:, None, :]).reshape(len(a), 9).dot(_CROSS)
    return out


def skew(v: Array) -> Array:
    """Matrices (N, 3, 3) of the cross products with v: their product with u is v × u."""
    out: Array = v.dot(_SKEW).reshape(-1, 3, 3)
    return out


def heading(rotation: Array) -> Array:
    """Yaw angles (N,) [rad] of rotation matrices (N, 3, 3)."""
    yaw: Array = np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])
    return yaw


def yaw_quaternions(yaw: Array) -> Array:
    """Level attitudes (N, 4) with these headings [rad]."""
    out = np.zeros((len(yaw), 4))
    out[:, 2], out[:, 3] = np.sin(0.5 * yaw), np.cos(0.5 * yaw)
    return out
