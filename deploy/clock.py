"""Time as a collaborator: the flight code never asks the operating system what time it is.

``SystemClock`` is wall time. ``VirtualClock`` is a simulated flight's time: it stands still until somebody sleeps,
and then carries the simulated world along. Nothing above this file may ask which one it has.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol

_INSTANT = 1e-9  # [s] times closer than this are the same


class Clock(Protocol):
    """What flight code may know about time."""

    @property
    def epoch(self) -> float:
        """Unix time [s] at which :meth:`now` was zero."""

    def now(self) -> float:
        """Seconds since the clock was made; never goes back."""

    def sleep_until(self, deadline: float) -> None:
        """Return when ``now() >= deadline`` (at once if it already is)."""

    def every(self, period: float, action: Callable[[], None]) -> Callable[[], None]:
        """Do something now and every ``period`` seconds, whatever the caller does; returns what ends it.

        In wall time that is a thread of its own: the action must not raise, and may block.
        """

    def hold(self) -> AbstractContextManager[None]:
        """Mark work that takes wall time (a connection, an upload); a rehearsal's clock stands meanwhile."""

    def owes(self) -> bool:
        """Whether work that held a rehearsal's clock takes flight time that has yet to pass: its packets'."""


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

    def every(self, period: float, action: Callable[[], None]) -> Callable[[], None]:
        """A thread that goes on until it is told to stop, or the process ends."""
        stopped = threading.Event()

        def run() -> None:
            due = self.now()
            while not stopped.wait(max(0.0, due - self.now())):
                action()
                due = max(due + period, self.now())  # what was missed is not made up for

        threading.Thread(target=run, name="every", daemon=True).start()
        return stopped.set

    @contextmanager
    def hold(self) -> Iterator[None]:
        """Wall time cannot be held: nothing to do."""
        yield

    def owes(self) -> bool:
        """Never: wall time has passed."""
        return False


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
            it only keeps a rehearsal from hanging for ever. Every time it runs out is counted in :attr:`stalls`.
    """

    def __init__(
        self, tick: float = 0.01, speed: float | None = None, epoch: float = 0.0, patience: float = 30.0
    ) -> None:
        if not tick > 0.0 or (speed is not None and not speed > 0.0):
            raise ValueError(f"a virtual clock has a positive tick and a positive speed or None; got {tick}, {speed}")
        self._tick, self._speed, self._epoch, self._patience = tick, speed, epoch, patience
        self._now = 0.0
        self._worlds: list[tuple[Callable[[float], None], Callable[[float], bool]]] = []
        self._holds = 0
        self._mine = threading.local()
        self._free = threading.Condition()
        self._stalls = 0
        self._debts: list[Callable[[], float]] = []
        self._paid = 0.0  # [s] when nothing is owed any more
        self._due = time.monotonic()

    @property
    def epoch(self) -> float:
        """Unix time [s] assigned to t = 0."""
        return self._epoch

    def now(self) -> float:
        """Simulated seconds."""
        return self._now

    def attach(
        self,
        advance: Callable[[float], None],
        settle: Callable[[float], bool],
        owed: Callable[[], float] | None = None,
    ) -> None:
        """Carry a world along.

        Args:
            advance: moves it to a time [s].
            settle: waits for its clients to digest, for at most so long [s].
            owed: flight time [s] of what it did while the clock was held, since the last call.
        """
        self._worlds.append((advance, settle))
        if owed is not None:
            self._debts.append(owed)

    def every(self, period: float, action: Callable[[], None]) -> Callable[[], None]:
        """As part of the world that is carried along."""
        due, going = self._now, True

        def advance(t: float) -> None:
            nonlocal due
            while going and due <= t + _INSTANT:
                due += period
                action()

        def stop() -> None:
            nonlocal going
            going = False

        self.attach(advance, lambda timeout: True)
        return stop

    @property
    def held(self) -> bool:
        """Whether somebody's work keeps time still."""
        return self._holds > 0

    def owes(self) -> bool:
        """Whether what was done while the clock stood takes until later than now; no news while somebody holds it."""
        if not self.held:
            self._paid = max(self._paid, self._now) + max((owed() for owed in self._debts), default=0.0)
        return self._now < self._paid - _INSTANT

    @property
    def stalls(self) -> int:
        """How often patience ran out: a rehearsal with stalls is not repeatable."""
        return self._stalls

    def sleep_until(self, deadline: float) -> None:
        """Advance to ``deadline`` tick by tick. Only the flight's own thread sleeps; workers hold instead.

        Raises:
            RuntimeError: the calling thread holds the clock itself and would wait for itself.
        """
        if getattr(self._mine, "holds", 0):
            raise RuntimeError("sleep_until within the same thread's hold: time cannot pass while it is held")
        while self._now < deadline - _INSTANT:
            free = self._settle()
            with self._free:
                if free and self._holds:  # somebody took hold while the worlds settled
                    continue
                step = self._step_towards(deadline)
            self._keep_pace(step)
        self._now = max(self._now, deadline)  # a rounding error away at most: now() >= deadline holds to the last bit

    @contextmanager
    def hold(self) -> Iterator[None]:
        """Keep time still while a worker is busy in wall time."""
        with self._free:  # a tick that is under way ends first: inside, time stands
            self._holds += 1
        self._mine.holds = getattr(self._mine, "holds", 0) + 1
        try:
            yield
        finally:
            self._mine.holds -= 1
            with self._free:
                self._holds -= 1
                self._free.notify_all()

    def _settle(self) -> bool:
        """Wait until nobody holds the clock and all clients have digested what they got; False: a hold is overrun."""
        with self._free:
            free = self._free.wait_for(lambda: self._holds == 0, timeout=self._patience)
            if not free:
                self._stalls += 1
        for _, settle in self._worlds:
            if not settle(self._patience):
                self._stalls += 1
        return free

    def _step_towards(self, deadline: float) -> float:
        """One step, to the next tick or the deadline, whichever is first; returns its length [s]."""
        began = self._now
        # Ticks are counted, not summed: a tick's time is a multiple of the tick to the last digit.
        tick = (math.floor(began / self._tick + 1e-6) + 1) * self._tick
        self._now = tick if tick <= deadline + _INSTANT else deadline
        for advance, _ in self._worlds:
            advance(self._now)
        return self._now - began

    def _keep_pace(self, step: float) -> None:
        if self._speed is None:
            return
        # Against a schedule, so that late wake-ups do not add up; a schedule that was missed is not caught up with.
        wall = time.monotonic()
        self._due = max(self._due + step / self._speed, wall - self._tick / self._speed)
        if self._due > wall:
            time.sleep(self._due - wall)
