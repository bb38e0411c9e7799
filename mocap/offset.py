"""What time is it there? The offset of another computer's clock, from stamps that arrive with delays."""

from __future__ import annotations

import math
from collections import deque

WINDOW = 10.0  # s; two quartz clocks drift apart by at most 1 ms in it (100 ppm)
JUMP = 0.5  # s; the other clock was set, or its recording began anew


class ClockOffset:
    """Local time of stamps of another clock.

    Every message arrives later than it was stamped, by a delay that varies; the fastest of the last ten seconds gives
    the offset (Cristian, Probabilistic Clock Synchronization, Distributed Computing 3, 1989, one way). What even the
    fastest needs cannot be seen from here.
    """

    def __init__(self) -> None:
        self._least: deque[tuple[float, float]] = deque()  # (arrival, difference), both rising: a sliding minimum

    def to_local(self, stamp: float, arrival: float) -> float:
        """Local time of a stamp [s], never later than its arrival.

        Args:
            stamp: by the other clock [s].
            arrival: by ours [s].
        """
        difference = arrival - stamp
        if abs(difference - self.seconds) > JUMP:
            self._least.clear()
        while self._least and self._least[-1][1] >= difference:
            self._least.pop()
        self._least.append((arrival, difference))
        while self._least[0][0] < arrival - WINDOW:
            self._least.popleft()
        return stamp + self._least[0][1]

    @property
    def seconds(self) -> float:
        """Our clock minus the other's, plus the fastest delay [s]; infinite before the first stamp."""
        return self._least[0][1] if self._least else math.inf
