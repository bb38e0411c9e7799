"""What follows from a finding: the mission's policies, and which one wins when several are due at once; no I/O.

====================  ===============================================================================================
``hold``              everybody brakes and hovers, until ``safety.hold_time`` is over, something else is found, or the
                      operator decides; then as ``land_all``
``return``            everybody brakes and flies to above his pad, planned from where everybody is; then all land
``land_here``         everybody brakes; this robot lands on the spot, and the others wait; then as ``return``
``land_all``          everybody brakes and lands where he is, or beside what is below
``stop_motors``       this robot's motors stop at once unless it would fall onto another; then as ``land_all``
====================  ===============================================================================================

The stronger wins, in the order of the table. All begin alike: everybody brakes at the same time, along his own way
(``stops.py``). So no two reactions are ever under way at once, and none counts on somebody who does something else.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from deploy.errors import FlightAborted
from missions.safety import Policy, Safety

ORDER: tuple[Policy, ...] = ("hold", "return", "land_here", "land_all", "stop_motors")


class Reaction(FlightAborted):
    """The mission ends early, in a certain way.

    Attributes:
        policy: how. robots: whom it is about; empty for everybody.
        since: when the condition that led to it first held [s]; NaN if it is none of the watch or the operator.
    """

    def __init__(
        self, reason: str, policy: Policy = "land_all", robots: Iterable[str] = (), since: float = math.nan
    ) -> None:
        self.policy, self.robots, self.since = policy, tuple(robots), since
        super().__init__(reason)


def policy_for(safety: Safety, kind: str) -> Policy:
    """The mission's policy for findings of a kind, which is the name of a field of the record."""
    policy: Policy = getattr(safety, kind)
    return policy


def strongest(policies: Iterable[Policy]) -> Policy:
    """The one that wins."""
    return max(policies, key=ORDER.index)
