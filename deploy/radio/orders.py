"""Orders to the supervisor that nobody answers for: emergency stop, its watchdog, arming.

Firmware from CRTP protocol 12 on takes them on the supervisor's port (crtp_supervisor.c), older firmware elsewhere
(crtp_localization_service.c, platformservice.c). cflib picks the port itself, but by what it knows at the moment: while
a link is being opened again it knows nothing, takes the drone for an old one, and complains. A stop must not depend on
that: a drone whose firmware is not known gets it both ways, and ignores the one it does not understand.
"""

from __future__ import annotations

from typing import TypeAlias

Order: TypeAlias = tuple[int, int, bytes]  # port, channel, payload
UNKNOWN = -1  # what cflib calls the protocol of a drone that has not told it yet
_SUPERVISOR_SINCE = 12
_SUPERVISOR, _LOCALIZATION, _PLATFORM = (9, 1), (6, 1), (13, 0)  # port and channel


def emergency_stop(protocol: int) -> tuple[Order, ...]:
    """Stop the motors now, in a drone that speaks ``protocol``."""
    return _either(protocol, (*_SUPERVISOR, b"\x03"), (*_LOCALIZATION, b"\x03"))


def feed_watchdog(protocol: int) -> tuple[Order, ...]:
    """Let them turn for one more second, from the first time on."""
    return _either(protocol, (*_SUPERVISOR, b"\x04"), (*_LOCALIZATION, b"\x04"))


def arm(protocol: int, wanted: bool) -> tuple[Order, ...]:
    """Arm or disarm."""
    return _either(protocol, (*_SUPERVISOR, bytes([1, wanted])), (*_PLATFORM, bytes([1, wanted])))


def _either(protocol: int, new: Order, old: Order) -> tuple[Order, ...]:
    if protocol == UNKNOWN:
        return new, old
    return (new,) if protocol >= _SUPERVISOR_SINCE else (old,)
