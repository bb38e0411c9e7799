"""A flight plan: everything that is needed to fly, and to check again without the solver."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from missions.schema import Mission
from planner.certificate.record import Certificate
from planner.plan import Plan
from planner.trajectory.encoded import EncodedTrajectory


@dataclass(frozen=True)
class FlightPlan:
    """Mission, plan, the bytes that will fly (by robot name, in the mission's order), and their certificate."""

    mission: Mission
    plan: Plan
    trajectories: Mapping[str, EncodedTrajectory]
    certificate: Certificate
    versions: Mapping[str, str]
