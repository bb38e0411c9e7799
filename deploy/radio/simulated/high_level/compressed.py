"""Compressed trajectories: Bézier segments of 16-bit control points (firmware pptraj_compressed.c).

Layout: start x, y, z [mm], yaw [0.1°] as int16; then segments of one type byte (two bits an axis: constant, linear,
cubic, degree 7), the duration [ms] as uint16 and the control points after the first, axis by axis. A segment of
duration zero ends the trajectory: the number of pieces given with the definition is ignored.
"""

from __future__ import annotations

import math
import struct

import numpy as np

from deploy.radio.simulated.high_level.evaluation import Evaluation, Float32, Polynomial
from deploy.radio.simulated.high_level.trajectory import TrajectoryMemory, at_rest, leading, shifted
from deploy.radio.simulated.interface import ZERO, Vec3
from missions.arrays import Array
from planner.trajectory.single import coefficients

_START = struct.Struct("<hhhh")
_HEAD = struct.Struct("<BH")
_POINTS = (0, 1, 3, 7)  # control points after the first, by type
_UNITS = np.array([1e3, 1e3, 1e3, 1800.0 / math.pi], np.float32)  # steps per metre and radian


class CompressedTrajectory:
    """A compressed trajectory in memory.

    Args:
        memory, offset: where it lies.
        begin: start [s], float32 seconds since boot.
    """

    def __init__(self, memory: TrajectoryMemory, offset: int, begin: np.float32) -> None:
        self._memory, self._offset, self._begin = memory, offset, begin
        self._shift = ZERO
        self._decoded: int | None = None

    @property
    def version(self) -> int:
        """That of the memory."""
        return self._memory.version

    def start_at(self, position: Vec3) -> None:
        """Move the trajectory so that it begins at ``position``."""
        self._shift = ZERO
        first = self.evaluate(self._begin).position
        x, y, z = (float(np.float32(a - b)) for a, b in zip(position, first, strict=True))
        self._shift = (x, y, z)

    def evaluate(self, t: np.float32) -> Evaluation:
        """The goal at ``t``."""
        return Evaluation.of(self.evaluate_all(np.array([t], np.float32)))

    def evaluate_all(self, t: Float32) -> Array:
        """Goals (16, k) at the first of the times ``t``; at a joint the later segment answers."""
        self._refresh()
        elapsed = t - self._begin
        if elapsed[0] >= self._total or not self._segments:
            return shifted(self._after.repeated(len(t)), self._shift)
        # Who asks for a time before the start gets the first segment's polynomial.
        number = max((i for i, (begin, _) in enumerate(self._segments) if elapsed[0] >= begin), default=0)
        begin, polynomial = self._segments[number]
        end = self._segments[number + 1][0] if number + 1 < len(self._segments) else self._total
        at = elapsed[: leading(elapsed < end)] - begin
        return shifted(polynomial.evaluate_all(at), self._shift)

    def is_finished(self, t: np.float32) -> bool:
        """Whether the end marker has been reached."""
        self._refresh()
        return bool(t - self._begin >= self._total)

    def _refresh(self) -> None:
        if self._decoded == self._memory.version:
            return
        self._decoded = self._memory.version
        raw = self._memory.read(self._offset, self._memory.size + 64)
        start, curves, milliseconds = _parse(raw, self._memory.size)
        self._segments: list[tuple[np.float32, Polynomial]] = []
        begin = np.float32(0.0)
        x, y, z, yaw = (np.array(start, np.float32) / _UNITS).tolist()
        end = Evaluation((x, y, z), yaw=yaw)
        decoded = coefficients(start, curves, np.array(milliseconds)).astype(np.float32)
        for segment, duration in zip(decoded, milliseconds, strict=True):
            self._segments.append((begin, Polynomial(segment)))
            begin += np.float32(duration / 1000.0)
        if self._segments:
            end = self._segments[-1][1].evaluate(np.float32(milliseconds[-1] / 1000.0))
        self._total = begin
        self._after = at_rest(end)


def _parse(raw: bytes, size: int) -> tuple[list[int], list[list[list[int]]], list[int]]:
    """Start, control points after the first by segment and axis, durations [ms]; all integers as they travel."""
    cursor = _START.size
    curves: list[list[list[int]]] = []
    durations: list[int] = []
    while cursor < size:
        types, milliseconds = _HEAD.unpack_from(raw, cursor)
        if milliseconds == 0:
            break
        cursor += _HEAD.size
        axes: list[list[int]] = []
        for axis in range(4):
            count = _POINTS[types >> (2 * axis) & 3]
            axes.append(np.frombuffer(raw, "<i2", count, cursor).tolist())
            cursor += 2 * count
        curves.append(axes)
        durations.append(milliseconds)
    return list(_START.unpack_from(raw)), curves, durations
