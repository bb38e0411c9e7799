"""Makes the events of a scenario happen when they are due, and writes them into the flight log."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable

from deploy.flightlog.writer import FlightLog
from deploy.scenario.effects import Props, begin
from deploy.scenario.load import targets
from deploy.scenario.records import Aimed, Fault, MocapSwap, Passing, Scenario
from missions.schema import Mission

_SLACK = 1e-9  # [s]


class Director:
    """Plays one scenario.

    Args:
        scenario: what happens. mission: who there is. props: what can be broken. log: where it is written down.
    """

    def __init__(self, scenario: Scenario, mission: Mission, props: Props, log: FlightLog) -> None:
        self._events, self._props, self._log = scenario.events, props, log
        self._names = {
            event: targets(event.to, mission) if isinstance(event, Aimed) else () for event in scenario.events
        }
        self._waiting = [event for event in scenario.events if event.when]
        self._order = itertools.count()
        self._due: list[tuple[float, int, Callable[[float], None]]] = []
        self._tripped: list[tuple[float, Fault]] = []
        for event in scenario.events:
            if event.at is not None:
                self._schedule(event.at + event.after, event)

    def advance(self, t: float) -> None:
        """Let everything happen that is due at ``t`` [s]. Raises ProcessKilled."""
        self._write_down()
        while self._due and self._due[0][0] <= t + _SLACK:
            _, _, act = heapq.heappop(self._due)
            act(t)

    def hear(self, t: float, name: str, text: str) -> None:
        """Something was written into the flight log at ``t`` [s]: an event's name and text."""
        cue = text if name == "phase" else name
        for event in [event for event in self._waiting if event.when == cue]:
            self._waiting.remove(event)
            if isinstance(event, Aimed) and event.packets and not event.after:
                self._come(t, event)  # at once: what is counted may be over before time passes
            else:
                self._schedule(t + event.after, event)

    def _schedule(self, t: float, event: Fault) -> None:
        heapq.heappush(self._due, (t, next(self._order), lambda now: self._come(now, event)))

    def _come(self, t: float, event: Fault) -> None:
        if isinstance(event, Aimed) and event.packets:
            self._props.air.lines[event.to].trip(event.packets, lambda: self._trip(event))
        else:
            self._tell(t, event, "")
            self._happen(t, event)

    def _trip(self, event: Fault) -> None:
        """In the thread that sends the packet, while time stands or moves on."""
        t = self._props.world.t
        self._tripped.append((t, event))
        self._happen(t, event)

    def _happen(self, t: float, event: Fault) -> None:
        undo = begin(event, self._names[event], self._props, self._log)
        if undo is not None and isinstance(event, Passing) and event.duration is not None:

            def end(now: float) -> None:
                undo()
                self._tell(now, event, " is over")

            heapq.heappush(self._due, (t + event.duration, next(self._order), end))

    def _write_down(self) -> None:
        """What packets have set off; in the order of the file, whichever thread was the first."""
        tripped, self._tripped = self._tripped, []
        for t, event in sorted(tripped, key=lambda item: (item[0], self._events.index(item[1]))):
            self._tell(t, event, "")

    def _tell(self, t: float, event: Fault, suffix: str) -> None:
        names = self._names[event]
        whom = ", ".join((*names, event.other) if isinstance(event, MocapSwap) else names)
        text = f"scenario: {event.fault}{f' ({whom})' if whom else ''}{suffix}"
        self._log.event(t, "scenario", text, robot=names[0] if len(names) == 1 else "")
