"""Round trips by the flight's own clock.

cflib pings, too, but by wall time and without saying what was lost; in a rehearsal its figures would be those of the
computer, not of the radio. Echo, port 15 channel 0; the first byte tells these packets from cflib's (which are 0).
"""

from __future__ import annotations

import math
import struct
from collections import deque
from typing import Any

from deploy.radio.requests import Reply, Request, Requests

_PORT = 0x0F
_OURS = 1
_REMEMBERED = 20


def is_foreign(packet: Any) -> bool:  # noqa: ANN401 - untyped library
    """Whether a packet is a ping that is not ours, or the answer to one."""
    return bool(packet.port == _PORT and packet.channel == 0 and packet.data[0:1] != bytes([_OURS]))


class Pings:
    """One ping under way at a time.

    Args:
        requests: of the drone.

    Attributes:
        lost: pings that were never answered.
    """

    def __init__(self, requests: Requests) -> None:
        self._requests = requests
        self._round_trips: deque[float] = deque(maxlen=_REMEMBERED)
        self._under_way: Reply | None = None
        self._count = self.lost = 0

    @property
    def latency(self) -> float:
        """Longest of the last round trips [ms]; NaN before the first."""
        return 1000.0 * max(self._round_trips, default=math.nan)

    def ping(self) -> None:
        """Account for the ping before, and send the next; call it at intervals no answer takes."""
        before = self._under_way
        if before is not None and before.arrived is not None:
            self._round_trips.append(before.arrived - before.sent)
        elif before is not None:
            self._requests.forget(before)
            self.lost += 1
        self._count += 1
        payload = struct.pack("<Bd", _OURS, float(self._count))  # cflib insists on its own length
        self._under_way = self._requests.send(Request(_PORT, 0, payload, payload, "ping"))
