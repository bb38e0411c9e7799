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

What is found while a flight ends early changes how it ends, and only ever to something stronger (:func:`joined`): who
hovers or flies home brakes once more and lands. The mission's policies hold there too, but none is weaker then than
``IN_AN_ABORT``: one reaction was already due, and the next is no time to wait or to fly about. Who brakes, lands or
steps aside to land finishes that first; motors that a policy stops stop at once.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from types import MappingProxyType

from deploy.errors import FlightAborted
from deploy.operator import Operator
from missions.safety import Policy, Safety

ORDER: tuple[Policy, ...] = ("hold", "return", "land_here", "land_all", "stop_motors")
IN_AN_ABORT: Mapping[str, Policy] = MappingProxyType(
    {
        "link": "land_all",  # the ways home count on everybody who flies
        "supervisor": "land_all",
        "pose": "land_all",
        "tracking": "land_all",
        "separation": "land_all",
        "geofence": "land_all",
        "battery": "land_here",  # it has to come down; the others may still get home
        "tilt": "land_all",
    }
)  # at least, by kind of finding
_OF_SOME: frozenset[Policy] = frozenset({"land_here", "stop_motors"})  # these mean certain robots


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


def asked(operator: Operator, now: float, *, aborting: bool) -> Reaction | None:
    """What the operator wants now [s]; to land whatever else is under way, to hold or go back before that only."""
    if operator.land_requested():
        return Reaction("the operator asked to land", since=now)
    if aborting:
        return None
    if operator.return_requested():
        return Reaction("the operator called everybody back", "return", since=now)
    if operator.hold_requested():
        return Reaction("the operator asked to hold", "hold", since=now)
    return None


def policy_for(safety: Safety, kind: str, *, aborting: bool = False) -> Policy:
    """The mission's policy for findings of a kind, which is the name of a field of the record.

    Args:
        safety: the mission's.
        kind: of finding.
        aborting: whether the flight ends early already.
    """
    policy: Policy = getattr(safety, kind)
    return strongest((policy, IN_AN_ABORT[kind])) if aborting else policy


def strongest(policies: Iterable[Policy]) -> Policy:
    """The one that wins."""
    return max(policies, key=ORDER.index)


def joined(doing: Reaction, found: Reaction) -> Reaction:
    """How a flight goes on to end that ends one way when another one is due; ``doing`` itself if that adds nothing.

    The stronger of the two. Of two that mean certain robots, and are equally strong, one that means all of them.
    """
    if ORDER.index(found.policy) != ORDER.index(doing.policy):
        return max(doing, found, key=lambda reaction: ORDER.index(reaction.policy))
    more = [robot for robot in found.robots if robot not in doing.robots]
    if doing.policy not in _OF_SOME or not more:
        return doing
    return Reaction(f"{doing}; {found}", doing.policy, (*doing.robots, *more), doing.since)
