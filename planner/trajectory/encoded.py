"""Encoded trajectories: the very bytes that fly, leg by leg."""

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
class Leg:
    """What one start command flies: bytes at a place in the drone's memory.

    Attributes:
        encoding: memory format.
        data: the bytes; a compressed leg includes its zero-duration end marker.
        pieces: number of pieces (the end marker does not count).
        offset: where the bytes lie in the trajectory memory.
        reason: why this encoding was taken, for people; no part of the hash or of equality.
    """

    encoding: Encoding
    data: bytes
    pieces: int
    offset: int = 0
    reason: str = field(default="", compare=False)

    @property
    def end(self) -> int:
        """First byte of the memory after the leg."""
        return self.offset + len(self.data)


@dataclass(frozen=True)
class EncodedTrajectory:
    """One robot's whole trajectory: one leg, or several that are flown one after another.

    A trajectory that fits the memory is one leg at offset 0. Any other is a chain of legs in alternating halves of the
    memory, of which the first two are there at take-off and the others are uploaded in flight.

    Attributes:
        legs: in the order they are flown; at least one.
    """

    legs: tuple[Leg, ...]

    def __post_init__(self) -> None:
        if not self.legs:
            raise ValueError("an encoded trajectory has at least one leg")

    @property
    def pieces(self) -> int:
        """Number of pieces of all legs."""
        return sum(leg.pieces for leg in self.legs)

    @property
    def size(self) -> int:
        """Bytes of all legs; of more than one leg this may be more than the memory holds."""
        return sum(len(leg.data) for leg in self.legs)

    @property
    def memory(self) -> int:
        """Bytes of memory that are used at one time or another."""
        return max(leg.end for leg in self.legs)

    @property
    def reason(self) -> str:
        """Why it is encoded as it is, for people."""
        return self.legs[0].reason

    @property
    def sha256(self) -> str:
        """Hash of the legs in their order: encodings, piece counts, offsets, lengths and bytes."""
        digest = hashlib.sha256()
        for leg in self.legs:
            digest.update(f"{leg.encoding.name}:{leg.pieces}:{leg.offset}:{len(leg.data)}:".encode() + leg.data)
        return digest.hexdigest()
