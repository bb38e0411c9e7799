"""A flight plan: everything that is needed to fly, and to check again without the solver."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from missions.schema import Mission
from planner.certificate.record import Certificate
from planner.plan import Plan
from planner.trajectory.encoded import EncodedTrajectory
from planner.transfers import Transfers


@dataclass(frozen=True)
class FlightPlan:
    """Everything of a flight.

    Attributes:
        mission: what is flown. plan: the samples it came from.
        trajectories: the bytes that will fly, by robot name, in the mission's order.
        certificate: of bytes and moves. versions: of what made it.
        transfers: the moves before and after the search; None for a search that nobody has to fly.
    """

    mission: Mission
    plan: Plan
    trajectories: Mapping[str, EncodedTrajectory]
    certificate: Certificate
    versions: Mapping[str, str]
    transfers: Transfers | None = None
