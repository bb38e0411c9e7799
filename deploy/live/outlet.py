"""From the flight to those who watch: a flight never waits for them, and nobody waits for another."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")
MOST_WAITING = 5000  # messages one who watches may be behind; ten minutes of frames


class Outlet(Generic[T]):
    """What one who watches has not got yet. Putting never blocks; what does not fit takes the place of the oldest."""

    def __init__(self, most: int = MOST_WAITING) -> None:
        self._waiting: deque[T] = deque(maxlen=most)
        self._something = threading.Condition()
        self._closed = False

    def put(self, item: T) -> None:
        """Hand over an item."""
        with self._something:
            self._waiting.append(item)
            self._something.notify()

    def close(self) -> None:
        """Nothing more will come."""
        with self._something:
            self._closed = True
            self._something.notify()

    def drain(self, send: Callable[[T], None]) -> None:
        """Send everything as it comes, until it is closed and empty, or sending raises."""
        while True:
            with self._something:
                while not (self._waiting or self._closed):
                    self._something.wait()
                if not self._waiting:
                    return
                item = self._waiting.popleft()
            send(item)
