"""The seam to whoever plans anew while drones fly: flying needs no solver, and knows none.

The command line puts one behind it (``deploy/cli/replanning.py``); without one, maps may change and trajectories stay.
"""

from __future__ import annotations

from typing import Protocol

from missions.schema import Mission
from planner.flightplan import FlightPlan


class Replanner(Protocol):
    """Plans the rest of a flight anew."""

    def __call__(self, current: FlightPlan, mission: Mission, joint: int) -> FlightPlan:
        """The flight plan that takes over at a joint of the mission, from 0; called in a thread of its own.

        Its legs before the joint are those of ``current``; the first one after it does not touch the bytes of the leg
        that it replaces; its certificate is for the whole.

        Raises:
            PlannerError: there is none.
        """
