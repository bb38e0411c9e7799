"""The memories behind port 4: what each of them is, reads and keeps."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import Protocol

from deploy.radio.simulated.decks import EEPROM_SIZE, Deck
from deploy.radio.simulated.high_level.trajectory import TrajectoryMemory

_TESTER_SIZE = 4096
_DECK_RECORDS, _DECK_RECORD = 8, 0x20  # two for each of four decks, of which no deck here has the second
_DECK_VERSION = 3
_VALID, _STARTED = 1, 2
_NONE = (0, 0, 0, 0, 0, b"")
_BYTES_PER_LED = 2  # RGB 565


class Memory(Protocol):
    """One memory; the port has tested that addresses lie inside."""

    kind: int
    size: int
    serial: bytes

    def read(self, address: int, length: int) -> bytes:
        """``length`` bytes."""

    def write(self, address: int, data: bytes) -> bool:
        """Keep the bytes; False if it cannot be written."""


class Trajectories:
    """Trajectory memory."""

    kind, serial = 0x12, bytes(8)

    def __init__(self, memory: TrajectoryMemory) -> None:
        self._memory, self.size = memory, memory.size

    def read(self, address: int, length: int) -> bytes:
        """A copy."""
        return self._memory.read(address, length)

    def write(self, address: int, data: bytes) -> bool:
        """Overwrite."""
        self._memory.write(address, data)
        return True


class Tester:
    """The firmware's tester: reads give the address, writes are compared with it.

    Args:
        wrong: called once for every byte written that differs from its address.
    """

    kind, size, serial = 0x15, _TESTER_SIZE, bytes(8)

    def __init__(self, wrong: Callable[[], None]) -> None:
        self._wrong = wrong

    def read(self, address: int, length: int) -> bytes:
        """The addresses' low bytes."""
        return bytes((address + i) & 0xFF for i in range(length))

    def write(self, address: int, data: bytes) -> bool:
        """Compare."""
        for i, byte in enumerate(data):
            if byte != (address + i) & 0xFF:
                self._wrong()
        return True


class Plain:
    """Bytes that stay as they are written (until a reboot).

    Args:
        kind: memory type.
        content: at the start.
        serial: eight bytes.
    """

    def __init__(self, kind: int, content: bytes, serial: bytes = bytes(8)) -> None:
        self.kind, self.size, self.serial = kind, len(content), serial
        self._content = bytearray(content)

    def read(self, address: int, length: int) -> bytes:
        """As written."""
        return bytes(self._content[address : address + length])

    def write(self, address: int, data: bytes) -> bool:
        """Overwrite."""
        self._content[address : address + len(data)] = data
        return True


class DeckMemory:
    """What decks say of their own memories (firmware deck_memory.c, version 3): a record each, nothing to be written.

    The size is that of the records; the real one also maps the decks' flash, which is absent.
    """

    kind, serial = 0x19, bytes(8)
    size = 1 + _DECK_RECORDS * _DECK_RECORD

    def __init__(self, plugged: Sequence[Deck]) -> None:
        listed = b"".join(
            struct.pack("<BBIII18s", *(_VALID | _STARTED, 0, 0, 0, 0, deck.name.encode()) if deck.has_memory else _NONE)
            + bytes(_DECK_RECORD)
            for deck in plugged
        )
        self._content = (bytes([_DECK_VERSION]) + listed).ljust(self.size, b"\0")

    def read(self, address: int, length: int) -> bytes:
        """The records."""
        return self._content[address : address + length]

    def write(self, address: int, data: bytes) -> bool:
        """Nothing can be written."""
        return False


def memories(
    trajectories: TrajectoryMemory, wrong: Callable[[], None], plugged: Sequence[Deck], hardware: bool
) -> list[Memory]:
    """All memories of a drone in their order: handlers of the firmware first, 1-wire ones last.

    Args:
        trajectories: trajectory memory.
        wrong: see :class:`Tester`.
        plugged: decks.
        hardware: False: only those of the recorded desktop build.
    """
    out: list[Memory] = [Trajectories(trajectories), Tester(wrong)]
    if hardware:
        out.append(DeckMemory(plugged))
        out += [Plain(0x10, bytes(_BYTES_PER_LED * deck.leds)) for deck in plugged if deck.leds]
        for place, deck in enumerate(plugged):
            serial = bytes([0x2D, deck.product, place, 0, 0, 0, 0, 0])  # 0x2D: family code of a DS28E05's kin
            out.append(Plain(0x01, deck.eeprom()[:EEPROM_SIZE], serial))
    return out
