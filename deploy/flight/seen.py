"""What the watch looks at, what it compares that with, and what it finds: records; no I/O."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from deploy.radio.supervisor import Supervisor
from missions.fleet import accelerations, fence, speeds
from missions.schema import Mission

Vec3 = tuple[float, float, float]
POSE_OLD, POSE_LOST = 0.25, 1.0  # s


@dataclass(frozen=True)
class Limits:
    """What the mission allows.

    Attributes:
        tracking, separation: [m]. lower, upper: corners of the box nobody may leave [m].
        braking: acceleration along an axis that everybody is able to brake with [m/s²].
        tilt: [rad]. voltage: [V].
        closing: how fast two robots that fly as they may come closer at most [m/s].
    """

    tracking: float
    separation: float
    lower: Vec3
    upper: Vec3
    braking: float = math.inf
    tilt: float = math.inf
    voltage: float = 0.0
    closing: float = 2.0

    @classmethod
    def of(cls, mission: Mission) -> Limits:
        """From the mission: the fence holds workspace, pads, starts and flight altitude, plus the margin."""
        margin = mission.flight.geofence_margin
        lower, upper = fence(mission)
        (x0, y0, z0), (x1, y1, z1) = (lower - margin).tolist(), (upper + margin).tolist()
        # The floor keeps drones from leaving downwards; an estimate may well be a little below it.
        box = (x0, y0, z0), (x1, y1, z1)
        braking, safety = float(accelerations(mission).max()), mission.safety
        own = mission.flight.tracking_limit, mission.limits.separation
        # Twice what is allowed: a robot that is off its way may be faster.
        closing = 4.0 * float(speeds(mission).max())
        return cls(*own, *box, braking, safety.tilt_limit, safety.battery_limit, closing)


@dataclass(frozen=True)
class Seen:
    """One drone at one moment.

    Attributes:
        position: [m], None if never seen. age: of the position [s].
        reference: where it should be [m]; None while it takes off, lands, or the flight ends early.
        supervisor: None before the first telemetry. battery_low: the firmware's word.
        silence: time since its last packet [s]. lost: why the link is gone; empty while it is up.
        untold: time since its last telemetry [s].
        velocity: [m/s] by its own estimate. ahead: works out where it will be [m] at the times
            ``separations.AHEAD``, as far as that is known; asked only for those who are near somebody.
        tilt: from the vertical [rad]. voltage: of its battery [V]. NaN if unknown.
    """

    robot: str
    position: Vec3 | None
    age: float
    reference: Vec3 | None
    supervisor: Supervisor | None
    battery_low: bool
    silence: float
    lost: str
    velocity: Vec3 = (0.0, 0.0, 0.0)
    ahead: Callable[[], tuple[Vec3, ...]] = tuple
    tilt: float = math.nan
    voltage: float = math.nan
    untold: float = 0.0

    @cached_property
    def soon(self) -> tuple[Vec3, ...]:
        """What :attr:`ahead` says, asked once: everybody who is near wants to know."""
        return self.ahead()


@dataclass(frozen=True)
class Finding:
    """A condition that holds, about one robot or a pair."""

    name: str
    robots: tuple[str, ...]
    level: Literal["warning", "abort"]
    text: str
    value: float
    patience: float = 0.0

    @property
    def robot(self) -> str:
        """Whom it is about, for people: ``a`` or ``a–b``."""
        return "–".join(self.robots)

    @property
    def kind(self) -> str:
        """What it is about: a key of the mission's ``safety`` record."""
        return self.name.split()[0]
