"""How prompt a flight is: round trips of commands, and from a finding to the last answer to what it led to."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from deploy.radio.requests import Reply


@dataclass(frozen=True)
class Latency:
    """Round trips of one drone's commands [s]; those that were sent once only."""

    count: int
    median: float
    largest: float

    def __str__(self) -> str:
        return f"{self.count} commands answered, {self.median * 1000:.1f} ms median, {self.largest * 1000:.1f} ms most"


def heard(reply: Reply, latency: float) -> float:
    """When a command reached the drone [s]: at once but for the radio's latency, at the latest half way to its answer.

    Half way alone would be too late: answers queue behind telemetry, commands wait for nobody.
    """
    return reply.sent + (latency if reply.arrived is None else min(latency, 0.5 * (reply.arrived - reply.sent)))


class Timing:
    """Collects the delays of a flight.

    Attributes:
        reaction: from when a condition first held to the last answer to the brake it led to [s]; NaN if none did.
    """

    def __init__(self) -> None:
        self._trips: dict[str, list[float]] = {}
        self.reaction = math.nan

    def answered(self, robot: str, reply: Reply) -> None:
        """Count an answer; one to a repeated command says nothing, for it may be to either copy."""
        if reply.arrived is not None and not reply.repeated:
            self._trips.setdefault(robot, []).append(reply.arrived - reply.sent)

    @property
    def latencies(self) -> Mapping[str, Latency]:
        """By robot, for those that answered."""
        return MappingProxyType(
            {name: Latency(len(trips), statistics.median(trips), max(trips)) for name, trips in self._trips.items()}
        )
