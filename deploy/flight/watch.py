"""What may not happen in flight, judged from one look at all drones; no I/O.

Two levels. A *warning* is written down. At the *action* level the mission's policy for the kind of finding decides
what happens (``safety:``, reactions.py; by default all brake, hover, and land in place together). A condition has to
last for its patience before it counts, so that one bad camera frame lands nobody.

============== ================================== ======================================= ===================
kind           warning                            action                                  patience
============== ================================== ======================================= ===================
link           silent for 0.5 s                   lost, or silent for 2 s (see below);    0 s; 0.5 s
                                                  no telemetry for 2 s, although it       for the latter
                                                  answers: it has restarted
supervisor                                        tumbled, locked, crashed, deck fault,   0.2 s
                                                  cannot fly
pose           older than 0.25 s                  older than 1 s                          0 s
tracking       beyond half of the limit           beyond ``flight.tracking_limit``        0.2 s
separation     5 cm below ``limits.separation``   below 60 % of it, now or as predicted   0.1 s
geofence                                          outside workspace, pads, starts and     0.1 s
                                                  ``flight.geofence_margin``, or too fast
                                                  to stop inside (horizontally)
battery        within 0.2 V of the limit          below ``safety.battery_limit``, or the  2 s; 0 s for the
                                                  firmware says low power                 firmware's word
tilt           beyond 70 % of the limit           beyond ``safety.tilt_limit``            0.1 s
============== ================================== ======================================= ===================

Separations are predicted from where drones are and will be if they go on to deviate from their trajectories as they do
now: drones that follow theirs are never predicted to meet.

A drone whose link is lost in the search, and which positions itself, flies its certified trajectory to the end: nobody
is safer than those who follow theirs beside it, so the mission goes on and the drone is a fault in the log. With
external positioning it is blind from then on, and the policy decides.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

from deploy.flight.seen import POSE_LOST, POSE_OLD, Finding, Limits, Seen, Vec3
from deploy.flight.separations import separations

QUIET, SILENT = 0.5, 2.0  # s
LOW_BATTERY = 0.2  # V above the limit
TILTED = 0.7  # share of the limit


def inspect(limits: Limits, drones: Sequence[Seen]) -> list[Finding]:
    """Everything that is wrong at one moment."""
    found: list[Finding] = []
    for drone in drones:
        if drone.lost or drone.silence > SILENT:
            found += _link(drone)
        else:
            found += [*_quiet(drone), *_body(limits, drone), *_place(limits, drone)]
    return [*found, *separations(limits, drones)]


def _link(drone: Seen) -> list[Finding]:
    why = drone.lost or f"silent for {drone.silence:.1f} s"
    return [Finding("link", (drone.robot,), "abort", f"link lost: {why}", drone.silence)]


def tilt(roll: float, pitch: float) -> float:
    """Angle between a drone's vertical and the world's [rad]."""
    return math.acos(max(-1.0, min(1.0, math.cos(roll) * math.cos(pitch))))


def _quiet(drone: Seen) -> list[Finding]:
    if drone.untold > max(SILENT, drone.silence):
        text = f"no telemetry for {drone.untold:.1f} s although it answers: has it restarted?"
        return [Finding("link telemetry", (drone.robot,), "abort", text, drone.untold, 0.5)]
    if drone.silence <= QUIET:
        return []
    return [Finding("link warning", (drone.robot,), "warning", f"silent for {drone.silence:.1f} s", drone.silence)]


def _body(limits: Limits, drone: Seen) -> list[Finding]:
    found: list[Finding] = []
    word = drone.supervisor
    if word is not None and (word.fault or not word.can_fly):
        text = f"supervisor: {word.fault or 'the drone can no longer fly'}"
        found.append(Finding("supervisor", (drone.robot,), "abort", text, float(word.bits), 0.2))
    if drone.battery_low:
        found.append(Finding("battery", (drone.robot,), "abort", "battery low", math.nan))
    elif drone.voltage < limits.voltage + LOW_BATTERY:
        level: Literal["warning", "abort"] = "abort" if drone.voltage < limits.voltage else "warning"
        text = f"battery at {drone.voltage:.2f} V; allowed {limits.voltage:.2f} V"
        found.append(Finding(f"battery {level}", (drone.robot,), level, text, drone.voltage, 2.0))
    if drone.tilt > TILTED * limits.tilt:
        level = "abort" if drone.tilt > limits.tilt else "warning"
        text = f"tilts by {math.degrees(drone.tilt):.0f}°; allowed {math.degrees(limits.tilt):.0f}°"
        found.append(Finding(f"tilt {level}", (drone.robot,), level, text, drone.tilt, 0.1))
    return found


def _place(limits: Limits, drone: Seen) -> list[Finding]:
    robots, position = (drone.robot,), drone.position
    found = []
    if position is None or drone.age > POSE_OLD:
        level: Literal["warning", "abort"] = "abort" if position is None or drone.age > POSE_LOST else "warning"
        found.append(Finding(f"pose {level}", robots, level, f"no pose for {drone.age:.2f} s", drone.age))
    if position is None:
        return found
    if not all(lo <= p <= hi for lo, p, hi in zip(limits.lower, position, limits.upper, strict=True)):
        where = ", ".join(f"{p:.2f}" for p in position)
        found.append(Finding("geofence", robots, "abort", f"outside the geofence at ({where}) m", math.nan, 0.1))
    elif (beyond := _overshoot(limits, position, drone.velocity)) > 0.0:
        text = f"too fast to stop inside the geofence: {beyond:.2f} m beyond"
        found.append(Finding("geofence", robots, "abort", text, beyond, 0.1))
    if drone.reference is not None:
        error = math.dist(position, drone.reference)
        if error > limits.tracking / 2:
            level = "abort" if error > limits.tracking else "warning"
            text = f"{error:.2f} m from where it should be; allowed {limits.tracking:.2f} m"
            found.append(Finding(f"tracking {level}", robots, level, text, error, 0.2))
    return found


def _overshoot(limits: Limits, position: Vec3, velocity: Vec3) -> float:
    """How far outside the box a drone would come to a stop [m], horizontally; negative: inside.

    Certified trajectories never are: on each axis they brake with what the mission allows, inside the workspace.
    """
    worst = -math.inf
    for lower, upper, p, v in zip(limits.lower[:2], limits.upper[:2], position, velocity, strict=False):
        stop = p + 0.5 * v * abs(v) / limits.braking
        worst = max(worst, lower - stop, stop - upper)
    return worst


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

    def since(self, finding: Finding) -> float:
        """Since when a condition that holds has held [s]."""
        return self._since[(finding.name, finding.robot)]
