"""What may not happen in flight, judged from one look at all drones; no I/O.

Two levels. A *warning* is written down. An *abort* ends the mission: all brake, hover, and land in place together. A
condition has to last for its patience before it counts, so that one bad camera frame lands nobody.

============== ================================== ======================================= ========
condition      warning                            abort                                   patience
============== ================================== ======================================= ========
link                                              lost, or silent for 2 s (see below)     0 s
supervisor                                        tumbled, locked, crashed, deck fault,   0.2 s
                                                  cannot fly
pose           older than 0.25 s                  older than 1 s                          0 s
tracking       beyond half of the limit           beyond ``flight.tracking_limit``        0.2 s
separation     5 cm below ``limits.separation``   below 60 % of it                        0.1 s
geofence                                          outside workspace, pads, starts and     0.1 s
                                                  ``flight.geofence_margin``
battery                                           the firmware says low power             0 s
============== ================================== ======================================= ========

A drone whose link is lost in the search, and which positions itself, flies its certified trajectory to the end: nobody
is safer than those who follow theirs beside it, so the mission goes on and the drone is a fault in the log. With
external positioning it is blind from then on, and everybody lands.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from deploy.radio.supervisor import Supervisor
from missions.fleet import fence
from missions.schema import Mission

Vec3 = tuple[float, float, float]
POSE_OLD, POSE_LOST = 0.25, 1.0  # s
SILENT = 2.0  # s
SEPARATION_SLACK = 0.05  # m
SEPARATION_SHARE = 0.6


@dataclass(frozen=True)
class Limits:
    """What the mission allows: tracking error and separation [m], and the box nobody may leave [m]."""

    tracking: float
    separation: float
    lower: Vec3
    upper: Vec3

    @classmethod
    def of(cls, mission: Mission) -> Limits:
        """From the mission: the fence holds workspace, pads, starts and flight altitude, plus the margin."""
        margin = mission.flight.geofence_margin
        lower, upper = fence(mission)
        (x0, y0, z0), (x1, y1, z1) = (lower - margin).tolist(), (upper + margin).tolist()
        # The floor keeps drones from leaving downwards; an estimate may well be a little below it.
        return cls(mission.flight.tracking_limit, mission.limits.separation, (x0, y0, z0), (x1, y1, z1))


@dataclass(frozen=True)
class Seen:
    """One drone at one moment.

    Attributes:
        position: [m], None if never seen. age: of the position [s].
        reference: where it should be [m]; None outside the search.
        supervisor: None before the first telemetry. battery_low: the firmware's word.
        silence: time since its last packet [s]. lost: why the link is gone; empty while it is up.
    """

    robot: str
    position: Vec3 | None
    age: float
    reference: Vec3 | None
    supervisor: Supervisor | None
    battery_low: bool
    silence: float
    lost: str


@dataclass(frozen=True)
class Finding:
    """A condition that holds."""

    name: str
    robot: str
    level: Literal["warning", "abort"]
    text: str
    value: float
    patience: float = 0.0


def inspect(limits: Limits, drones: Sequence[Seen]) -> list[Finding]:
    """Everything that is wrong at one moment."""
    found: list[Finding] = []
    for drone in drones:
        found += _link(drone) if drone.lost or drone.silence > SILENT else [*_body(drone), *_place(limits, drone)]
    for a, b in itertools.combinations(drones, 2):
        found += _separation(limits, a, b)
    return found


def _link(drone: Seen) -> list[Finding]:
    why = drone.lost or f"silent for {drone.silence:.1f} s"
    return [Finding("link", drone.robot, "abort", f"link lost: {why}", drone.silence)]


def _body(drone: Seen) -> list[Finding]:
    found = []
    word = drone.supervisor
    if word is not None and (word.fault or not word.can_fly):
        text = f"supervisor: {word.fault or 'the drone can no longer fly'}"
        found.append(Finding("supervisor", drone.robot, "abort", text, float(word.bits), 0.2))
    if drone.battery_low:
        found.append(Finding("battery", drone.robot, "abort", "battery low", math.nan))
    return found


def _place(limits: Limits, drone: Seen) -> list[Finding]:
    robot, position = drone.robot, drone.position
    found = []
    if position is None or drone.age > POSE_OLD:
        level: Literal["warning", "abort"] = "abort" if position is None or drone.age > POSE_LOST else "warning"
        found.append(Finding(f"pose {level}", robot, level, f"no pose for {drone.age:.2f} s", drone.age))
    if position is None:
        return found
    if not all(lo <= p <= hi for lo, p, hi in zip(limits.lower, position, limits.upper, strict=True)):
        where = ", ".join(f"{p:.2f}" for p in position)
        found.append(Finding("geofence", robot, "abort", f"outside the geofence at ({where}) m", math.nan, 0.1))
    if drone.reference is not None:
        error = math.dist(position, drone.reference)
        if error > limits.tracking / 2:
            level = "abort" if error > limits.tracking else "warning"
            text = f"{error:.2f} m from where it should be; allowed {limits.tracking:.2f} m"
            found.append(Finding(f"tracking {level}", robot, level, text, error, 0.2))
    return found


def _separation(limits: Limits, a: Seen, b: Seen) -> list[Finding]:
    if a.position is None or b.position is None or max(a.age, b.age) > POSE_LOST:
        return []
    distance = math.dist(a.position, b.position)
    if distance >= limits.separation - SEPARATION_SLACK:
        return []
    level: Literal["warning", "abort"] = "abort" if distance < SEPARATION_SHARE * limits.separation else "warning"
    pair = f"{a.robot}–{b.robot}"
    text = f"{distance:.2f} m apart; the mission asks for {limits.separation:.2f} m"
    return [Finding(f"separation {level}", pair, level, text, distance, 0.1)]


class Watch:
    """Remembers since when conditions hold.

    Args:
        limits: what is allowed.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._since: dict[tuple[str, str], float] = {}
        self._told: set[tuple[str, str]] = set()

    def look(self, now: float, drones: Sequence[Seen]) -> list[Finding]:
        """Conditions that have lasted for their patience, each once until it goes away."""
        found = {(finding.name, finding.robot): finding for finding in inspect(self._limits, drones)}
        self._since = {key: self._since.get(key, now) for key in found}
        self._told &= found.keys()
        fresh = [
            finding
            for key, finding in found.items()
            if key not in self._told and now - self._since[key] >= finding.patience - 1e-9
        ]
        self._told |= {(finding.name, finding.robot) for finding in fresh}
        return fresh
