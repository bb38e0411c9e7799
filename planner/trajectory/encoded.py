"""Encoded trajectories: the very bytes that fly."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from enum import Enum

MEMORY_SIZE = 4096  # bytes of trajectory memory on a Crazyflie (firmware TRAJECTORY_MEMORY_SIZE)


class Encoding(Enum):
    """Formats of the trajectory memory; values as in the firmware's trajectory type byte."""

    POLY4D = 0
    COMPRESSED = 1


@dataclass(frozen=True)
class EncodedTrajectory:
    """One robot's trajectory as it will lie in the drone's memory.

    Attributes:
        encoding: memory format.
        data: the bytes, at most :data:`MEMORY_SIZE`; a compressed trajectory includes its zero-duration end marker.
        pieces: number of pieces (the end marker does not count).
        reason: why this encoding was taken, for people; no part of the hash or of equality.
    """

    encoding: Encoding
    data: bytes
    pieces: int
    reason: str = field(default="", compare=False)

    @property
    def sha256(self) -> str:
        """Hash of encoding, piece count and bytes."""
        head = f"{self.encoding.name}:{self.pieces}:".encode()
        return hashlib.sha256(head + self.data).hexdigest()
