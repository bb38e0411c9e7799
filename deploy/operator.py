"""The person in charge: once to land everybody, twice to stop the motors."""

from __future__ import annotations

import signal
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Literal, Protocol

Word = Literal["land", "hold", "abort", "stop"]


class Operator(Protocol):
    """What the flight asks the operator at every tick."""

    def land_requested(self) -> bool:
        """Whether everybody shall land now."""

    def hold_requested(self) -> bool:
        """Whether everybody shall brake and hover."""

    def return_requested(self) -> bool:
        """Whether everybody shall fly back over his pad and land."""

    def stop_requested(self) -> bool:
        """Whether the motors shall stop now, in whatever height."""


class Nobody:
    """An operator who lets the flight run."""

    def land_requested(self) -> bool:
        """Never."""
        return False

    def hold_requested(self) -> bool:
        """Never."""
        return False

    def return_requested(self) -> bool:
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

    def hold_requested(self) -> bool:
        """Whether either wants it."""
        return self._one.hold_requested() or self._other.hold_requested()

    def return_requested(self) -> bool:
        """Whether either wants it."""
        return self._one.return_requested() or self._other.return_requested()

    def stop_requested(self) -> bool:
        """Whether either wants it."""
        return self._one.stop_requested() or self._other.stop_requested()


class Interrupts:
    """An operator who counts requests to land: the first lands, the second stops the motors. May be called anywhere."""

    def __init__(self) -> None:
        self._count = 0
        self._hold = self._return = self._stop = False
        self._maps: deque[str] = deque(maxlen=1)

    def request(self) -> None:
        """Land; once more: stop the motors. Safe to call in a signal handler."""
        self._count += 1

    def say(self, word: Word) -> None:
        """Say what is wanted; ``land`` any number of times only lands, ``abort`` calls everybody back to the pads."""
        if word == "land":
            self._count = max(self._count, 1)
        elif word == "hold":
            self._hold = True
        elif word == "abort":
            self._return = True
        else:
            self._stop = True

    def tell_map(self, text: str) -> None:
        """Say that the information is another, as YAML or JSON; of several maps the last one counts."""
        self._maps.append(text)

    def new_map(self) -> str | None:
        """The map that was told, once; None: nothing new."""
        try:
            return self._maps.pop()
        except IndexError:
            return None

    def land_requested(self) -> bool:
        """Whether there was a request."""
        return self._count >= 1

    def hold_requested(self) -> bool:
        """Whether somebody said so."""
        return self._hold

    def return_requested(self) -> bool:
        """Whether somebody said so."""
        return self._return

    def stop_requested(self) -> bool:
        """Whether there were two requests to land, or somebody said so."""
        return self._count >= 2 or self._stop


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
