"""Lost links in flight: tried again with growing pauses, from a thread each, for as long as anybody flies.

What a new connection sends a drone obeys nobody: questions for its tables, and telemetry to begin. It goes on flying
what it was told last until somebody tells it something else; here is only found out that this is possible again.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from deploy.aside import Aside
from deploy.clock import Clock
from deploy.errors import DeployError
from deploy.radio.fleet import Fleet

_FIRST_PAUSE, _LONGEST_PAUSE = 0.5, 4.0  # s


@dataclass
class _Attempt:
    """The next attempt at one link.

    Attributes:
        lost: when it was noticed [s]. due: when to try [s]. pause: before the one after it [s].
        aside: it, if under way.
    """

    lost: float
    due: float
    pause: float = _FIRST_PAUSE
    aside: Aside[None] | None = None


class Rescue:
    """Looks after the links of a flight.

    Args:
        fleet: whose. clock: the flight's. rate: of telemetry [Hz].
    """

    def __init__(self, fleet: Fleet, clock: Clock, rate: float) -> None:
        self._fleet, self._clock, self._rate = fleet, clock, rate
        self._attempts: dict[str, _Attempt] = {}

    def turn(self, now: float) -> dict[str, float]:
        """Begin what is due and end what is done; drones whose links are up again, and for how long they were not [s].

        Raises:
            Whatever else an attempt raised: a bug.
        """
        for name, drone in self._fleet.items():
            if drone.lost and name not in self._attempts:
                self._attempts[name] = _Attempt(now, now + _FIRST_PAUSE)
        back = {}
        for name, attempt in list(self._attempts.items()):
            if attempt.aside is None:
                if now >= attempt.due - 1e-9:
                    attempt.aside = Aside(partial(self._fleet[name].reconnect, self._rate), self._clock, f"{name}-link")
                    attempt.aside.start()
            elif attempt.aside.done and not self._clock.owes():  # what it took on the air has passed
                del self._attempts[name]  # first: a bug is raised once, not every turn
                try:
                    attempt.aside.outcome()
                except DeployError:
                    pause = min(2.0 * attempt.pause, _LONGEST_PAUSE)
                    self._attempts[name] = _Attempt(attempt.lost, now + pause, pause)
                else:
                    back[name] = now - attempt.lost
        return back
