"""The person in charge: once to land everybody, twice to stop the motors."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Protocol


class Operator(Protocol):
    """What the flight asks the operator at every tick."""

    def land_requested(self) -> bool:
        """Whether everybody shall land now."""

    def stop_requested(self) -> bool:
        """Whether the motors shall stop now, in whatever height."""


class Nobody:
    """An operator who lets the flight run."""

    def land_requested(self) -> bool:
        """Never."""
        return False

    def stop_requested(self) -> bool:
        """Never."""
        return False


class Either:
    """Two operators, each of whom may end the flight."""

    def __init__(self, one: Operator, other: Operator) -> None:
        self._one, self._other = one, other

    def land_requested(self) -> bool:
        """Whether either wants it."""
        return self._one.land_requested() or self._other.land_requested()

    def stop_requested(self) -> bool:
        """Whether either wants it."""
        return self._one.stop_requested() or self._other.stop_requested()


class Interrupts:
    """An operator who counts requests: the first lands, the second stops the motors."""

    def __init__(self) -> None:
        self._count = 0

    def request(self) -> None:
        """One more; safe to call in a signal handler."""
        self._count += 1

    def land_requested(self) -> bool:
        """Whether there was a request."""
        return self._count >= 1

    def stop_requested(self) -> bool:
        """Whether there were two."""
        return self._count >= 2


@contextmanager
def interrupts() -> Iterator[Interrupts]:
    """While inside, Ctrl-C (SIGINT) lands everybody and a second one stops the motors; SIGTERM lands, too.

    From the main thread only. Restores the handlers that were there before.
    """
    operator = Interrupts()

    def on_interrupt(number: int, frame: FrameType | None) -> None:
        operator.request()

    def on_termination(number: int, frame: FrameType | None) -> None:
        # Whoever terminates us may do so twice without meaning "let them fall".
        if not operator.land_requested():
            operator.request()

    before = {
        signal.SIGINT: signal.signal(signal.SIGINT, on_interrupt),
        signal.SIGTERM: signal.signal(signal.SIGTERM, on_termination),
    }
    try:
        yield operator
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
