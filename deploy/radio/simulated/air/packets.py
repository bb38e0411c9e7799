"""What is on a line: packets under way, up and down, and the time of those that were handed over at once."""

from __future__ import annotations

from typing import NamedTuple


class Up(NamedTuple):
    """A packet to the drone: since when it waits, or when it arrives [s]."""

    t: float
    header: int
    data: bytes


class Down(NamedTuple):
    """A packet to the client: since when it waits, or when it arrives [s]."""

    t: float
    port: int
    channel: int
    data: bytes


class Debt(NamedTuple):
    """What packets that were handed over at once would have taken [s]: the line by itself, and its dongle."""

    line: float = 0.0
    dongle: float = 0.0
