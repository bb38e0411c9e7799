"""LED rings that show how wide each robot sees, as long as nothing else is to be said.

A colour is one packet in half a second, written into the ring's ``fadeColor`` (firmware ledring12.c); the ring fades
from one to the next by itself. Nothing waits for it: it is sent at the end of a turn of the loop, one a turn, while
the plan is flown and nobody reacts to anything, and not to a drone that has not answered the one before.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from deploy.errors import DeployError
from deploy.flightlog.writer import FlightLog
from deploy.radio.fleet import Fleet
from deploy.radio.requests import Reply
from missions.fleet import altitudes
from missions.lights import DARK, LIGHT_PERIOD, Colour, colour, lit, spread
from missions.schema import Mission

_FADE = 14  # number of the firmware's effect that fades from colour to colour
LEAST_HEIGHT = 0.05  # m: nobody searches nearer the floor
_PATIENCE = 2.0  # s without an answer until a colour is sent again
Vec3 = tuple[float, float, float]


def ring_parameters(mission: Mission, robot: str) -> dict[str, float]:
    """On-board parameters of a robot's LED ring, in order: dark, and ready to fade."""
    if robot not in lit(mission):
        return {}
    return {"ring.fadeTime": LIGHT_PERIOD, "ring.fadeColor": 0.0, "ring.effect": float(_FADE)}


def _distances(mission: Mission) -> tuple[float, float]:
    """Between which robots search, from the floor or from the object [m]."""
    box, planned = mission.workspace, altitudes(mission)
    if mission.object is not None:
        return mission.object.near, mission.object.far or math.dist(box.lower, box.upper)
    if mission.dimension == 2:
        return float(planned.min()), float(planned.max())
    return max(box.lower[2], LEAST_HEIGHT), box.upper[2]


class Lights:
    """The rings of a flight.

    Args:
        mission: whose rings and footprints. fleet: who flies. log: where colours that were taken are written.
    """

    def __init__(self, mission: Mission, fleet: Fleet, log: FlightLog) -> None:
        self._fleet, self._log = fleet, log
        names = lit(mission)
        self._sees = {r.name: f for r, f in zip(mission.robots, mission.footprints, strict=False) if r.name in names}
        surface = None if mission.object is None else mission.object.surface
        self._points = None if surface is None else surface.points
        low, high = _distances(mission)
        self._bounds = {name: (spread(f, low), spread(f, high)) for name, f in self._sees.items()}
        self._shown: dict[str, Colour] = dict.fromkeys(self._sees, DARK)
        self._due: dict[str, float] = dict.fromkeys(self._sees, -math.inf)
        self._asked: dict[str, tuple[Reply, Colour, float]] = {}
        self._silent: set[str] = set()  # drones whose firmware has no such parameter

    def turn(self, now: float, where: Callable[[str], Vec3 | None], showing: bool) -> None:
        """At most one packet. ``where``: a robot's position [m], if it is known; ``showing``: else rings go dark."""
        self._listen(now)
        for name, footprint in self._sees.items():
            if now < self._due[name] or name in self._asked or name in self._silent or name not in self._fleet:
                continue
            position = where(name) if showing else None
            if showing and position is None:
                continue
            wide = 0.0 if position is None else spread(footprint, self._distance(position))
            wanted = DARK if position is None else colour(wide, *self._bounds[name])
            self._due[name] = now + LIGHT_PERIOD
            if wanted != self._shown[name]:
                self._say(name, wanted, wide)
                return

    def _distance(self, position: Vec3) -> float:
        """From what is looked at [m]."""
        if self._points is None:
            return position[2]
        return float(np.linalg.norm(self._points - np.array(position), axis=1).min())

    def _listen(self, now: float) -> None:
        """Write down what was answered; give up what was not."""
        for name, (reply, sent, wide) in list(self._asked.items()):
            if reply.here:
                del self._asked[name]
                self._shown[name] = sent
                self._log.light(name, now, sent, wide)
            elif now - reply.sent > _PATIENCE:
                del self._asked[name]
                self._fleet[name].forget(reply)

    def _say(self, name: str, wanted: Colour, wide: float) -> None:
        drone = self._fleet[name]
        if not drone.connected:
            return
        red, green, blue = wanted
        try:
            reply = drone.send_parameter("ring.fadeColor", float(red << 16 | green << 8 | blue))
        except DeployError:
            if drone.connected:
                self._silent.add(name)  # older firmware: the flight does not depend on it
            return
        self._asked[name] = reply, wanted, wide
