"""One Crazyradio: it talks to one drone at a time, to all of its drones in turn."""

from __future__ import annotations

from collections.abc import Sequence

from deploy.radio.simulated.air.line import Line
from deploy.radio.simulated.air.model import AirModel


class Dongle:
    """Shares its time between the lines that want an exchange.

    Args:
        model: of the radio.
        lines: who shares it, in the order they are polled.
    """

    def __init__(self, model: AirModel, lines: Sequence[Line]) -> None:
        self._lines = tuple(lines)
        self._exchange, self._retune = 1.0 / model.packet_rate, model.retune
        self._free = 0.0
        self._last = -1  # index of the line served last
        self._tuning = lines[0].station.tuning if lines else ""

    def advance(self, t: float) -> None:
        """Exchange what can be exchanged before ``t`` [s]."""
        now = self._free
        while now < t:
            line = self._next(now)
            if line is None:
                now = min(t, max(now, min((line.due for line in self._lines), default=t)))
                continue
            slot = self._exchange
            if line.station.tuning != self._tuning:
                self._tuning = line.station.tuning
                slot += self._retune
            now = line.exchange(now, slot)
        self._free = now
        for line in self._lines:
            line.settle(t)

    def _next(self, now: float) -> Line | None:
        count = len(self._lines)
        for k in range(self._last + 1, self._last + 1 + count):
            line = self._lines[k % count]
            if line.due <= now:
                self._last = k % count
                return line
        return None
