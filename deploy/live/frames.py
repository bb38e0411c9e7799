"""The page's feed: a frame ten times a second, with the whole flight so far for those who come late."""

from __future__ import annotations

import json
import math
import threading
from collections.abc import Sequence

from deploy.flight.records import FlightStatus, RobotStatus
from deploy.live.outlet import Outlet

MOST_FRAMES = 36_000  # of history: an hour; later ones are still sent as they come


class Frames:
    """Turns statuses into frames and hands them to every outlet.

    Args:
        robots: names, in the mission's order.
    """

    def __init__(self, robots: Sequence[str]) -> None:
        self._robots = tuple(robots)
        self._history: list[str] = []
        self._outlets: set[Outlet[str]] = set()
        self._lock = threading.Lock()
        self._over = False

    def show(self, status: FlightStatus) -> None:
        """A flight's observer: encode one frame and return."""
        text = encode(status, self._robots)
        with self._lock:
            if len(self._history) < MOST_FRAMES:
                self._history.append(text)
            for outlet in self._outlets:
                outlet.put(text)

    def join(self) -> Outlet[str]:
        """An outlet that begins with everything so far."""
        outlet: Outlet[str] = Outlet()
        with self._lock:
            outlet.put(f'{{"begin":[{",".join(self._history)}]}}')
            if self._over:
                _end(outlet)
            self._outlets.add(outlet)
        return outlet

    def leave(self, outlet: Outlet[str]) -> None:
        """Nobody is at this outlet any more."""
        with self._lock:
            self._outlets.discard(outlet)

    def end(self) -> None:
        """The flight is over: say so and let everybody go."""
        with self._lock:
            self._over = True
            for outlet in self._outlets:
                _end(outlet)


def encode(status: FlightStatus, robots: Sequence[str]) -> str:
    """A frame as JSON.

    ``t`` [s], ``phase``, ``m``: mission time [s], ``e`` and ``certified``: E so far and at the end, ``text``: newest
    event, ``r``: by robot ``[position, target, state, V, ms, error in m, note]``, null for one who is left behind.
    """
    known = {robot.name: robot for robot in status.robots}
    frame = {
        "t": round(status.t, 3),
        "phase": status.phase.value.replace("_", " "),
        "m": _number(status.mission_time),
        "e": _number(status.ergodicity, 9),
        "certified": _number(status.certified, 9),
        "text": status.message,
        "r": [_robot(known[name]) if name in known else None for name in robots],
    }
    return json.dumps(frame, allow_nan=False, separators=(",", ":"))


def _robot(robot: RobotStatus) -> list[object]:
    return [
        None if robot.position is None else [_number(value) for value in robot.position],
        None if robot.target is None else [_number(value) for value in robot.target],
        robot.state,
        _number(robot.voltage),
        _number(robot.latency),
        _number(robot.error),
        robot.note,
    ]


def _number(value: float, digits: int = 3) -> float | None:
    return round(float(value), digits) if math.isfinite(value) else None


def _end(outlet: Outlet[str]) -> None:
    outlet.put('{"end":true}')
    outlet.close()
