"""The emergency-stop watchdog: with ``safety.on_host_loss: motor_stop`` drones fall when this computer is gone.

The firmware stops the motors for good a second after the last keepalive, once it has had a first one (supervisor.c); it
knows no gentler end. Keepalives are sent by threads of their own, one a drone: a link whose queue is full holds up
nobody else's, and neither does a flight loop that waits for a disk. A loop that has not turned for ``HUNG`` is as good
as dead: nobody watches or sends poses any more, and the keepalives end.

What remains: a process that the operating system stops without ending it (SIGSTOP, a suspended laptop) and a thread
that keeps Python's interpreter lock end the keepalives, too: drones fall though the process is not dead. And after
every such flight drones are locked, a second after the flight has ended, until they are switched off and on.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from deploy.clock import Clock
from deploy.radio.fleet import Fleet

PERIOD = 0.2  # s: four of five may be lost in a row
HUNG = 5.0  # s without a turn of the flight loop


class Keepalive:
    """Feeds every drone's watchdog from :meth:`start` to :meth:`stop`.

    Args:
        fleet: whose. clock: the flight's. latest: when the flight loop turned last [s].
    """

    def __init__(self, fleet: Fleet, clock: Clock, latest: Callable[[], float]) -> None:
        self._fleet, self._clock, self._latest = fleet, clock, latest
        self._stops: list[Callable[[], None]] = []

    def start(self) -> None:
        """From now on a drone that hears nothing for a second stops its motors."""
        self._stops += [self._clock.every(PERIOD, partial(self._feed, name)) for name in self._fleet]

    def stop(self) -> None:
        """No more keepalives: for drones on the ground."""
        while self._stops:
            self._stops.pop()()

    def _feed(self, name: str) -> None:
        if self._clock.now() - self._latest() <= HUNG:
            self._fleet[name].feed_watchdog()
