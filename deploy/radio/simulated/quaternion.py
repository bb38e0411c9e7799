"""Quaternions x, y, z, w as they travel: 32 bits, smallest three (firmware quatcompress.h)."""

from __future__ import annotations

import math

from deploy.radio.simulated.interface import Quat, Vec3

_BITS, _MASK = 9, 0x1FF
_SQRT_HALF = math.sqrt(0.5)


def decompress(packed: int) -> Quat:
    """Bits 31-30: index of the largest component; then sign and 9 bits of the others, last component lowest."""
    largest = packed >> 30
    values, total = [0.0, 0.0, 0.0, 0.0], 0.0
    for i in (3, 2, 1, 0):
        if i == largest:
            continue
        magnitude = _SQRT_HALF * (packed & _MASK) / _MASK
        values[i] = -magnitude if packed >> _BITS & 1 else magnitude
        total += magnitude * magnitude
        packed >>= _BITS + 1
    values[largest] = math.sqrt(max(0.0, 1.0 - total))
    return (values[0], values[1], values[2], values[3])


def compress(q: Quat) -> int:
    """Inverse of :func:`decompress`; errors up to 0.0014 per component."""
    largest = max(range(4), key=lambda i: abs(q[i]))
    negate = q[largest] < 0.0
    packed = largest
    for i in range(4):
        if i != largest:
            magnitude = int(_MASK * min(abs(q[i]) / _SQRT_HALF, 1.0) + 0.5)
            packed = packed << 1 | ((q[i] < 0.0) != negate)
            packed = packed << _BITS | magnitude
    return packed


def euler(q: Quat) -> Vec3:
    """Roll, pitch, yaw [rad], z-y-x convention, right-handed."""
    x, y, z, w = q
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(min(max(2.0 * (w * y - z * x), -1.0), 1.0))
    return (roll, pitch, math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def to_body(q: Quat, v: Vec3) -> Vec3:
    """A world vector in body coordinates."""
    x, y, z, w = -q[0], -q[1], -q[2], q[3]
    cx, cy, cz = y * v[2] - z * v[1], z * v[0] - x * v[2], x * v[1] - y * v[0]
    return (
        v[0] + 2.0 * (w * cx + y * cz - z * cy),
        v[1] + 2.0 * (w * cy + z * cx - x * cz),
        v[2] + 2.0 * (w * cz + x * cy - y * cx),
    )
