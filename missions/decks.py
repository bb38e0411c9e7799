"""Expansion decks that a robot may carry, and which of them tell it where it is.

A deck that was found at start-up reads 1 in a read-only parameter (the drivers' ``PARAM_GROUP_START(deck)``,
firmware ``src/deck/drivers/src/*.c``); a deck that is there but broken, or not pushed home, reads 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

DeckName = Literal["active_marker", "flow2", "led_ring", "lighthouse4", "loco", "multiranger", "zranger2"]


@dataclass(frozen=True, slots=True)
class DeckKind:
    """One kind of deck.

    Attributes:
        board: name in its 1-wire memory, which is that of its driver in the firmware.
        parameter: that reads 1 if the drone has found it.
        positions: whether a drone that has nothing else knows where it is.
    """

    board: str
    parameter: str
    positions: bool = False


DECKS: Mapping[DeckName, DeckKind] = MappingProxyType(
    {
        "active_marker": DeckKind("bcActiveM", "deck.bcActiveMarker"),
        "flow2": DeckKind("bcFlow2", "deck.bcFlow2", positions=True),
        "led_ring": DeckKind("bcLedRing", "deck.bcLedRing"),
        "lighthouse4": DeckKind("bcLighthouse4", "deck.bcLighthouse4", positions=True),
        "loco": DeckKind("bcDWM1000", "deck.bcDWM1000", positions=True),
        "multiranger": DeckKind("bcMultiranger", "deck.bcMultiranger"),
        "zranger2": DeckKind("bcZRanger2", "deck.bcZRanger2"),
    }
)
"""By the name in a mission."""

_DOWNWARD = ("flow2", "zranger2")  # both look at the floor, with the same sensor at the same address


def fault(decks: Sequence[DeckName]) -> tuple[int, str] | None:
    """Which of the decks of one robot cannot be, and why: its index and the reason; None if all can."""
    for i, deck in enumerate(decks):
        if deck in decks[:i]:
            return i, f"got {deck!r} twice; allowed: one of a kind"
    if all(deck in decks for deck in _DOWNWARD):
        i = max(decks.index("flow2"), decks.index("zranger2"))
        return i, "got flow2 and zranger2; allowed: one of them, a flow2 brings the zranger2's sensor along"
    return None
