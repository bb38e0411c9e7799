"""Work in a thread of its own while the flight loop goes on turning."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from deploy.clock import Clock

T = TypeVar("T")


class Aside(Generic[T]):
    """Something that takes wall time and, in a rehearsal, no flight time: its thread holds the clock.

    Args:
        work: what to do; must end by itself.
        clock: the flight's.
        name: of the thread.
    """

    def __init__(self, work: Callable[[], T], clock: Clock, name: str) -> None:
        self.done = False
        self._result: T | None = None
        self._error: BaseException | None = None
        self._work, self._clock = work, clock
        self._holding = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        """Return when the thread holds the clock, so that no flight time passes before it has begun."""
        self._thread.start()
        self._holding.wait()

    def outcome(self) -> T:
        """What the work returned, once it is done. Raises what it raised."""
        if self._error is not None:
            raise self._error
        return self._result  # type: ignore[return-value]

    def _run(self) -> None:
        with self._clock.hold():
            self._holding.set()
            try:
                self._result = self._work()
            except BaseException as error:  # noqa: BLE001 - raised again in the flight's own thread
                self._error = error
            finally:
                self.done = True  # before the clock is let go
