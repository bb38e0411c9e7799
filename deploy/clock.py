"""Time as a collaborator: the flight code never asks the operating system what time it is.

``SystemClock`` is wall time. ``VirtualClock`` is a simulated flight's time: it stands still until somebody sleeps,
and then carries the simulated world along. Nothing above this file may ask which one it has.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol


class Clock(Protocol):
    """What flight code may know about time."""

    @property
    def epoch(self) -> float:
        """Unix time [s] at which :meth:`now` was zero."""

    def now(self) -> float:
        """Seconds since the clock was made; never goes back."""

    def sleep_until(self, deadline: float) -> None:
        """Return when ``now() >= deadline`` (at once if it already is)."""

    def hold(self) -> AbstractContextManager[None]:
        """Mark work that takes wall time but, in a rehearsal, no flight time (a connection, an upload)."""


class SystemClock:
    """Wall time, monotonic."""

    def __init__(self) -> None:
        self._start = time.monotonic()
        self._epoch = time.time()

    @property
    def epoch(self) -> float:
        """Unix time [s] at construction."""
        return self._epoch

    def now(self) -> float:
        """Seconds since construction."""
        return time.monotonic() - self._start

    def sleep_until(self, deadline: float) -> None:
        """Sleep in wall time."""
        while (left := deadline - self.now()) > 0:
            time.sleep(left)

    @contextmanager
    def hold(self) -> Iterator[None]:
        """Wall time cannot be held: nothing to do."""
        yield


class VirtualClock:
    """Simulated time: advances only inside :meth:`sleep_until`, carrying attached worlds along.

    Time moves in ticks. Before each tick the clock waits (in wall time) until nobody holds it and every attached
    world has settled, i.e. the client's threads have digested what the drones sent: that is what makes a rehearsal
    repeatable although cflib is threaded.

    Args:
        tick: largest step [s].
        speed: how much faster than wall time it may run at most; None for as fast as possible.
        epoch: Unix time of t = 0 [s]; fixed by default so that rehearsals repeat.
        patience: longest wall time [s] to wait for a hold or a world before time moves on regardless; generous,
            it only keeps a rehearsal from hanging for ever.
    """

    def __init__(
        self, tick: float = 0.01, speed: float | None = None, epoch: float = 0.0, patience: float = 30.0
    ) -> None:
        self._tick, self._speed, self._epoch, self._patience = tick, speed, epoch, patience
        self._now = 0.0
        self._worlds: list[tuple[Callable[[float], None], Callable[[float], bool]]] = []
        self._holds = 0
        self._free = threading.Condition()

    @property
    def epoch(self) -> float:
        """Unix time [s] assigned to t = 0."""
        return self._epoch

    def now(self) -> float:
        """Simulated seconds."""
        return self._now

    def attach(self, advance: Callable[[float], None], settle: Callable[[float], bool]) -> None:
        """Carry a world along: ``advance(t)`` moves it to t; ``settle(timeout)`` waits for its clients to digest."""
        self._worlds.append((advance, settle))

    def sleep_until(self, deadline: float) -> None:
        """Advance to ``deadline`` tick by tick. Only the flight's own thread sleeps; workers hold instead."""
        while self._now < deadline - 1e-9:
            began = time.monotonic()
            with self._free:
                self._free.wait_for(lambda: self._holds == 0, timeout=self._patience)
            for _, settle in self._worlds:
                settle(self._patience)
            step = min(self._tick, deadline - self._now)
            # Ticks are counted, not summed: t stays a multiple of the tick to the last digit.
            count = round((self._now + step) / self._tick)
            target = count * self._tick
            self._now = target if abs(target - (self._now + step)) < 1e-9 else self._now + step
            for advance, _ in self._worlds:
                advance(self._now)
            if self._speed is not None:
                spare = step / self._speed - (time.monotonic() - began)
                if spare > 0:
                    time.sleep(spare)

    @contextmanager
    def hold(self) -> Iterator[None]:
        """Keep time still while a worker is busy in wall time."""
        with self._free:
            self._holds += 1
        try:
            yield
        finally:
            with self._free:
                self._holds -= 1
                self._free.notify_all()
