"""Compressed curves as the firmware computes them: in single precision, operation by operation.

From control points b_i to powers of u (firmware ``pptraj.c``: ``polybezier``),

    c_j = n!/(n−j)! Σ_{i<=j} (−1)^(i+j) b_i / (i! (j−i)!),

then to seconds (``polystretchtime``); every segment begins where the one before ended *when evaluated*
(``pptraj_compressed.c``). The alternating sums lose digits: up to 0.03 mm against exact arithmetic, which a decoder
that says what will fly has to show.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array

_Single = NDArray[np.float32]
_FACTORIALS = tuple(np.float32(math.factorial(k)) for k in range(8))
_UNITS: _Single = np.array([1e3, 1e3, 1e3, 1800.0 / math.pi], np.float32)  # integer steps per metre or radian
_ONE = np.float32(1.0)


def coefficients(start: Sequence[int], curves: Sequence[Sequence[Sequence[int]]], milliseconds: Array) -> Array:
    """(M, 4, 8) ascending powers of the seconds since a segment's start.

    Args:
        start: integer coordinates that the first segment starts at [mm, 0.1°].
        curves: per segment and axis the 0, 1, 3 or 7 integer control points after the first one.
        milliseconds: (M,) durations.
    """
    out = np.zeros((len(curves), 4, 8), np.float32)
    first: _Single = np.array(start, np.float32) / _UNITS
    for segment, (axes, duration) in enumerate(zip(curves, milliseconds, strict=True)):
        T = np.float32(duration / 1000.0)
        for count in {len(points) for points in axes}:
            same = [axis for axis in range(4) if len(axes[axis]) == count]
            b = np.concatenate(
                [first[None, same], np.array([axes[axis] for axis in same], np.float32).T / _UNITS[same]]
            )
            out[segment, same, : count + 1] = _powers(b, T).T
        value = np.zeros(4, np.float32)
        for k in range(7, -1, -1):  # Horner
            value = value * T + out[segment, :, k]
        first = value
    return out.astype(np.float64)


def _powers(b: _Single, T: np.float32) -> _Single:
    """(n+1, axes) coefficients from control points b (n+1, axes)."""
    n = len(b) - 1
    if n == 0:
        return b
    if n == 1:
        return np.stack([b[0], (b[1] - b[0]) / T])
    out = np.zeros_like(b)
    scale, reciprocal = _ONE, _ONE / T
    for j in range(n + 1):
        total = np.zeros_like(b[0])
        for i in range(j + 1):
            term = b[i] / _FACTORIALS[i] / _FACTORIALS[j - i]
            total = total - term if (i + j) % 2 else total + term
        out[j] = total * _FACTORIALS[n] / _FACTORIALS[n - j] * scale
        scale = scale * reciprocal
    return out
