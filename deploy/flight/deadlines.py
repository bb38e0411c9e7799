"""How long what is under way may take: what the plan takes for it, and what the table of phases allows beyond.

What waits for something waits until then (:attr:`Deadline.left`), and says who is late. Behind it stands the flight
loop: whatever is not over ``BACKSTOP`` later is given up, whoever was to look after it, with :class:`Overdue`.

Times are the flight clock's; entering a phase begins a deadline, and so does every further step of a phase in which
several follow one another (tries on the ground, waves of landings, the parts of an early end).
"""

from __future__ import annotations

import math

from deploy.flight.reactions import Reaction
from deploy.phases import TABLE, Phase
from planner.flightplan import FlightPlan
from planner.transfers import Transfers, duration

BACKSTOP = 2.0  # s; longer than any command is repeated


class Overdue(Reaction):
    """What was under way took too long and is given up."""


class Deadline:
    """The present one."""

    def __init__(self) -> None:
        self._due, self._what, self._takes = math.inf, "", math.inf

    def begin(self, now: float, phase: Phase, takes: float, *, like: Phase | None = None) -> None:
        """What begins now in a phase takes so long [s], and may take that phase's, or another's, allowance more."""
        self._takes = takes + TABLE[like or phase].allowance
        self._due, self._what = now + self._takes, (like or phase).value

    def left(self, now: float) -> float:
        """Until it is due [s]; not negative."""
        return max(0.0, self._due - now)

    def check(self, now: float) -> None:
        """Give it up if it should be over by now, once.

        Raises:
            Overdue: it should.
        """
        if now > self._due + BACKSTOP:
            self._due = math.inf
            raise Overdue(f"{self._what}: not over within {self._takes:.1f} s")


def planned(plan: FlightPlan, phase: Phase, search: float) -> float:
    """What a plan takes for a phase [s]; 0 for those that end when something has happened.

    Args:
        plan: what flies.
        phase: which.
        search: duration of the trajectories [s].
    """
    flight, transfers = plan.mission.flight, plan.transfers or Transfers({}, {}, {}, {})
    takes = {
        Phase.TAKING_OFF: duration(transfers.take_off),
        Phase.TRANSFERRING: duration(transfers.approach),
        Phase.SETTLING: flight.settle_time,
        Phase.ON_MISSION: search,
        Phase.HOLDING: flight.settle_time,
        Phase.RETURNING: duration(transfers.back),
    }
    return takes.get(phase, 0.0)
