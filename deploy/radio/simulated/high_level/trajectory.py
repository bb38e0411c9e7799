"""The three things the planner can follow: a planned piece, pieces in memory, a compressed trajectory in memory.

Pieces are used in place: who rewrites the memory in flight changes the flight. Decoding is therefore cached for one
version of the memory only.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from deploy.radio.simulated.high_level.evaluation import (
    Evaluation,
    Float32,
    Polynomial,
    normalize_angle,
    rest_to,
    stretch_time,
)
from deploy.radio.simulated.interface import ZERO, Vec3
from missions.arrays import Array

PIECE_BYTES = 132  # x[8], y[8], z[8], yaw[8], duration: float32
_ZERO32 = np.float32(0.0)


def leading(flags: NDArray[np.bool_]) -> int:
    """How many of the first flags are set."""
    return len(flags) if flags.all() else int(flags.argmin())


class Trajectory(Protocol):
    """What the planner needs; times are float32 seconds since boot."""

    @property
    def version(self) -> int:
        """Changes when goals that were given before no longer hold."""

    def evaluate_all(self, t: Float32) -> Array:
        """Goals (16, k) at the first of the rising times ``t`` (K,), one at least; after the end the last, at rest."""

    def is_finished(self, t: np.float32) -> bool:
        """Whether the trajectory has ended at ``t``."""


class TrajectoryMemory:
    """Bytes that clients write and trajectories read.

    Attributes:
        size: in bytes.
        version: rises with every write.
    """

    def __init__(self, size: int = 4096) -> None:
        self.size = size
        self.version = 0
        self._data = bytearray(size)

    def read(self, address: int, length: int) -> bytes:
        """``length`` bytes; zeros where the firmware would read past its array."""
        return bytes(self._data[address : address + length]).ljust(length, b"\0")

    def write(self, address: int, data: bytes) -> None:
        """Overwrite; the caller has tested the bounds."""
        self._data[address : address + len(data)] = data
        self.version += 1


def at_rest(evaluation: Evaluation) -> Evaluation:
    """The same place without motion: what the firmware gives after a trajectory's end."""
    return Evaluation(evaluation.position, yaw=evaluation.yaw)


def shifted(goals: Array, shift: Vec3, rotation: float = 0.0) -> Array:
    """Goals (16, K) rotated about the world's z axis, then moved. The jerk is left as it is, as in the firmware."""
    if rotation:
        c, s = math.cos(rotation), math.sin(rotation)
        for row in (0, 3, 6):  # position, velocity, acceleration
            x, y = goals[row].copy(), goals[row + 1].copy()
            goals[row], goals[row + 1] = c * x - s * y, s * x + c * y
        goals[12] += normalize_angle(rotation)
    if shift != ZERO:
        goals[:3] += np.array(shift)[:, None]
    return goals


class PlannedPiece:
    """One piece the planner made itself (take-off, landing, go-to, spiral)."""

    def __init__(self, begin: np.float32, duration: np.float32, start: Float32, end: Float32) -> None:
        self._begin, self._duration = begin, duration
        self._polynomial = Polynomial(rest_to(duration, start, end))
        self.version = 0

    @cached_property
    def _after(self) -> Evaluation:
        return at_rest(self._polynomial.evaluate(self._duration))

    def evaluate_all(self, t: Float32) -> Array:
        """Goals (16, k) at the first of the times ``t``."""
        elapsed = t - self._begin
        inside = leading(elapsed <= self._duration)
        return self._polynomial.evaluate_all(elapsed[:inside]) if inside else self._after.repeated(len(t))

    def is_finished(self, t: np.float32) -> bool:
        """Whether the piece has ended."""
        return bool(t - self._begin >= self._duration)


class PolynomialTrajectory:
    """Poly4D pieces in memory (firmware ``piecewise_eval`` and ``piecewise_eval_reversed``).

    Args:
        memory, offset, pieces: where the pieces lie.
        begin: start [s].
        timescale: above 1 is slower.
        reverse: fly from the last point to the first.
    """

    def __init__(
        self,
        memory: TrajectoryMemory,
        offset: int,
        pieces: int,
        begin: np.float32,
        timescale: np.float32,
        reverse: bool = False,
    ) -> None:
        self._memory, self._offset, self._count = memory, offset, pieces
        self._begin, self._timescale, self._reverse = begin, timescale, reverse
        self._shift, self._rotation = ZERO, 0.0
        self._decoded: object = None

    @property
    def version(self) -> int:
        """That of the memory."""
        return self._memory.version

    def start_at(self, position: Vec3, yaw: float | None) -> None:
        """Move the trajectory so that it begins at ``position``; with a yaw also turn it to begin with that.

        The shift is computed without the rotation, which turns about the trajectory's own origin: unless the
        trajectory begins at x = y = 0 it jumps. That is the firmware's behaviour.
        """
        first = self.evaluate(self._begin)
        x, y, z = (float(np.float32(a - b)) for a, b in zip(position, first.position, strict=True))
        if yaw is not None and not self._reverse:
            self._rotation = normalize_angle(normalize_angle(yaw) - normalize_angle(first.yaw))
        self._shift = (x, y, z)

    def evaluate(self, t: np.float32) -> Evaluation:
        """The goal at ``t``."""
        return Evaluation.of(self.evaluate_all(np.array([t], np.float32)))

    def evaluate_all(self, t: Float32) -> Array:
        """Goals (16, k) at the first of the times ``t``; at a joint the earlier piece (in flying order) answers."""
        self._refresh()
        remaining = t - self._begin
        for polynomial, duration in self._pieces:
            inside = leading(remaining <= duration)
            if inside:
                at = remaining[:inside]
                if self._reverse:
                    return shifted(polynomial.evaluate_all(duration - at, -1), self._shift)
                return shifted(polynomial.evaluate_all(at), self._shift, self._rotation)
            remaining = remaining - duration
        return self._after.repeated(len(t))

    def is_finished(self, t: np.float32) -> bool:
        """Whether all pieces have been flown."""
        self._refresh()
        return bool(t - self._begin >= self._total)

    def _refresh(self) -> None:
        """Decode the pieces again if somebody wrote to the memory or the trajectory moved."""
        key = (self._memory.version, self._shift, self._rotation)
        if key == self._decoded:
            return
        self._decoded = key
        count = max(self._count, 1)
        raw = self._memory.read(self._offset, count * PIECE_BYTES)
        table = np.frombuffer(raw, dtype="<f4").astype(np.float32).reshape(count, 33)
        pieces = [(row[:32].reshape(4, 8), row[32]) for row in table]
        flown = [
            (Polynomial(stretch_time(coefficients, self._timescale)), np.float32(duration * self._timescale))
            for coefficients, duration in pieces
        ][: self._count]
        self._pieces = flown[::-1] if self._reverse else flown
        self._total = sum((duration for _, duration in flown), start=_ZERO32)
        coefficients, duration = pieces[0] if self._reverse else pieces[-1]
        last = Polynomial(coefficients).evaluate(_ZERO32 if self._reverse else duration)
        self._after = at_rest(Evaluation.of(shifted(last.repeated(1), self._shift, self._rotation)))
