"""Expansion decks that can be plugged in: who they say they are, and what they bring along.

A deck names itself in a 1-wire EEPROM, which clients read while they connect (layout: cflib ow_element.py; ids: the
firmware's deck drivers). What a deck measures is simulated for none of them but the ranger that looks down; positions
come from ``SimulatedCrazyflie.sense``.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

EEPROM_SIZE = 112
_MAGIC, _VENDOR = 0xEB, 0xBC
_NAME, _REVISION = 1, 2  # element types


@dataclass(frozen=True, slots=True)
class Deck:
    """One kind of deck.

    Attributes:
        name: board name, as the firmware's driver knows it.
        product: product id; the vendor is always Bitcraze.
        parameters: deck.* that read 1.
        revision: board revision.
        has_memory: it is listed in the deck memory.
        positions: the drone's poses come from it.
        looks_down: it measures the distance to the floor.
        leds: of an LED ring.
    """

    name: str
    product: int
    parameters: tuple[str, ...]
    revision: str = "A"
    has_memory: bool = False
    positions: bool = False
    looks_down: bool = False
    leds: int = 0

    def eeprom(self) -> bytes:
        """The EEPROM's 112 bytes."""
        head = struct.pack("<BIBB", _MAGIC, 0, _VENDOR, self.product)
        items = b"".join(
            bytes([kind, len(text)]) + text.encode("latin-1")
            for kind, text in ((_NAME, self.name), (_REVISION, self.revision))
        )
        elements = bytes([0, len(items)]) + items
        return (head + _check(head) + elements + _check(elements)).ljust(EEPROM_SIZE, b"\xff")


def _check(data: bytes) -> bytes:
    return bytes([zlib.crc32(data) & 0xFF])


DECKS: Mapping[str, Deck] = MappingProxyType(
    {
        deck.name: deck
        for deck in (
            Deck("bcLedRing", 0x01, ("bcLedRing",), leds=12),
            Deck("bcDWM1000", 0x06, ("bcDWM1000", "bcLoco")),
            Deck("bcMultiranger", 0x0C, ("bcMultiranger",)),
            Deck("bcZRanger2", 0x0E, ("bcZRanger2",), looks_down=True),
            Deck("bcFlow2", 0x0F, ("bcFlow2", "bcZRanger2"), looks_down=True),
            Deck("bcLighthouse4", 0x10, ("bcLighthouse4",), has_memory=True, positions=True),
            Deck("bcActiveM", 0x11, ("bcActiveMarker",)),
        )
    }
)
"""By board name."""


def decks(names: tuple[str, ...]) -> tuple[Deck, ...]:
    """The decks with these board names.

    Raises:
        ValueError: an unknown name.
    """
    for name in names:
        if name not in DECKS:
            raise ValueError(f"deck {name!r} is not known; allowed: {', '.join(sorted(DECKS))}")
    return tuple(DECKS[name] for name in names)
