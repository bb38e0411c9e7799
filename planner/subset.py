"""A flight plan without some of its robots: the same bytes of the others, certified anew.

Who does not take off is nobody's obstacle, but may have been somebody's link: separation can only grow, connectivity
can break. Nothing is assumed; the certificate of the others is computed from their bytes.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

from missions.connectivity import NoConnectivity
from missions.schema import Connectivity, Mission
from planner.certificate.certify import certify
from planner.certificate.errors import CertificateError
from planner.flightplan import FlightPlan
from planner.transfers import Passage, Transfers


def without(flight_plan: FlightPlan, leaving: Collection[str]) -> FlightPlan:
    """What the others fly, and its certificate, which may fail.

    Args:
        flight_plan: of everybody.
        leaving: names of robots that do not fly; at least one other remains.

    Raises:
        CertificateError: nobody is left, or the policy is about robots that leave only: it would say nothing.
    """
    mission = flight_plan.mission
    stay = [k for k, robot in enumerate(mission.robots) if robot.name not in leaving]
    if not stay:
        raise CertificateError("nobody is left to fly")
    left = mission_without(mission, leaving)
    plan = flight_plan.plan
    trajectories = _kept(flight_plan.trajectories, leaving)
    moves = flight_plan.transfers
    transfers = None
    if moves is not None:
        passages: dict[str, Passage] = {
            item.name: _kept(getattr(moves, item.name), leaving) for item in dataclasses.fields(Transfers)
        }
        transfers = Transfers(**passages)
    return replace(
        flight_plan,
        mission=left,
        plan=replace(plan, q=plan.q[:, stay], v=plan.v[:, stay], u=plan.u[:, stay]),
        trajectories=trajectories,
        certificate=certify(left, trajectories, transfers),
        transfers=transfers,
    )


def mission_without(mission: Mission, leaving: Collection[str]) -> Mission:
    """The mission of the others: pairs and zones of those who leave go with them.

    Raises:
        CertificateError: no pair of the policy is left, or the hub of its star leaves.
    """
    # A zone without names binds everybody: one that bound only those who leave has to go, not to bind the others.
    zones = (
        replace(zone, robots=tuple(name for name in zone.robots if name not in leaving)) if zone.robots else zone
        for zone in mission.zones
        if not zone.robots or set(zone.robots) - set(leaving)
    )
    return replace(
        mission,
        robots=tuple(robot for robot in mission.robots if robot.name not in leaving),
        zones=tuple(zones),
        connectivity=_policy(mission.connectivity, leaving),
    )


def _policy(policy: Connectivity, leaving: Collection[str]) -> Connectivity:
    if isinstance(policy, NoConnectivity):
        return policy
    changes: dict[str, Any] = {}
    if isinstance(policy.pairs, tuple):
        changes["pairs"] = tuple(pair for pair in policy.pairs if not set(pair) & set(leaving))
        if not changes["pairs"]:
            raise CertificateError(f"every pair of the connectivity policy has {' or '.join(sorted(leaving))} in it")
    if policy.pairs == "star" and policy.hub in leaving:
        raise CertificateError(f"{policy.hub} is the hub that everybody has to meet")
    thresholds = getattr(policy, "thresholds", ())
    if thresholds:
        changes["thresholds"] = tuple(item for item in thresholds if not set(item.pair) & set(leaving))
    return replace(policy, **changes)


def _kept(items: Mapping[str, Any], leaving: Collection[str]) -> dict[str, Any]:
    return {name: item for name, item in items.items() if name not in leaving}
