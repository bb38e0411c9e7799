"""What a flight tells its observer while it lasts, and its caller when it is over."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from deploy.flight.timing import Latency
from deploy.phases import Phase
from deploy.preflight import PreflightReport
from missions.decks import DeckName

Vec3 = tuple[float, float, float]


@dataclass(frozen=True)
class Ready:
    """What one drone said of itself when it was connected.

    Attributes:
        firmware: version text. memory: trajectory memory [bytes], 0 if none.
        decks: that it has found; None if its firmware knows of none.
        parameters: on-board parameters that were set and read back.
    """

    firmware: str
    memory: int
    decks: tuple[DeckName, ...] | None
    parameters: Mapping[str, float]


@dataclass(frozen=True)
class RobotStatus:
    """One robot, now.

    Attributes:
        position: where it is [m]; None if nobody knows.
        error: distance to where it should be [m]; NaN outside the mission.
        voltage: battery [V]. latency: of the link [ms]. NaN while unknown.
        note: what is wrong with it; empty if nothing is.
        target: where the certified trajectory is [m]; None outside the mission.
        state: what its supervisor says; empty while unknown. level: of the battery [%]. quality: of the link [%].
    """

    name: str
    position: Vec3 | None
    error: float
    voltage: float
    latency: float
    note: str = ""
    target: Vec3 | None = None
    state: str = ""
    level: float = math.nan
    quality: float = math.nan


@dataclass(frozen=True)
class FlightStatus:
    """The whole flight, now.

    Attributes:
        t: flight clock [s]. phase: where the flight is.
        mission_time: time since the search began [s]; NaN before. duration: length of the search [s].
        robots: in the mission's order. message: newest event.
        ergodicity: E of everything flown since the search began; NaN before. certified: of the bytes, at its end.
    """

    t: float
    phase: Phase
    mission_time: float
    duration: float
    robots: tuple[RobotStatus, ...]
    message: str = ""
    ergodicity: float = math.nan
    certified: float = math.nan


@dataclass(frozen=True)
class FlightOutcome:
    """How a flight ended.

    Attributes:
        phase: LANDED, ABORTED or EMERGENCY.
        reason: why it ended early; empty if it did not.
        preflight: what was checked.
        faults: every fault, in order. warnings: likewise.
        landed: by robot, whether it was seen on the ground with its motors off.
        start_skew: between the first and the last trajectory start [s]; NaN if there was none.
        largest_error: largest distance to the certified trajectory [m], by robot.
        duration: from connection to the end [s].
        left_behind: who did not take off, and why, by robot.
        latencies: round trips of commands, by robot. reaction: from a finding to the last answer [s]; NaN if none.
    """

    phase: Phase
    reason: str
    preflight: PreflightReport
    faults: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    landed: Mapping[str, bool] = field(default_factory=lambda: MappingProxyType({}))
    start_skew: float = math.nan
    largest_error: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    duration: float = math.nan
    left_behind: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    latencies: Mapping[str, Latency] = field(default_factory=lambda: MappingProxyType({}))
    reaction: float = math.nan

    @property
    def completed(self) -> bool:
        """Whether everybody flew the whole mission and landed, without a fault."""
        return self.phase is Phase.LANDED and not self.faults and all(self.landed.values())
