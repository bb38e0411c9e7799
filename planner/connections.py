"""The constraints of a mission's connectivity policy, tightened by margins."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from missions import fleet
from missions.arrays import Array
from missions.connectivity import (
    AllTimeConnectivity,
    GuaranteedConnectivity,
    NoConnectivity,
    PeriodicConnectivity,
    ProbabilisticConnectivity,
    SimultaneousConnectivity,
)
from missions.indicator import Indicator
from missions.schema import Mission
from missions.topology import pair_thresholds, policy_pairs, rendezvous_steps, sub_period_steps
from planner.connectivity.quadrature import Quadrature, every_step, thinned
from planner.constraints.base import Constraint
from planner.constraints.connected import connected
from planner.constraints.connection import Connection
from planner.constraints.contact import Contact
from planner.constraints.contact_time import ContactTime
from planner.constraints.meeting import Meeting
from planner.constraints.pairwise import PairConstraint
from planner.constraints.rendezvous import Rendezvous
from planner.constraints.simultaneous import Simultaneous
from planner.dynamics import Dynamics
from planner.margins import Margins

NODE_SPACING = 0.8  # distance between nodes of connection probabilities at full speed, in widths of the indicator


class Connections(NamedTuple):
    """What has to hold, and what the search enforces too but a plan may miss."""

    required: tuple[Constraint, ...] = ()
    preferred: tuple[Constraint, ...] = ()


def connections(mission: Mission, margins: Margins, dynamics: Dynamics) -> Connections:
    """Constraints of the policy.

    Args:
        mission: what is asked for.
        margins: how much more is planned.
        dynamics: the robots': where they stand decides which spanning trees a search begins with.
    """
    policy = mission.connectivity
    if isinstance(policy, NoConnectivity) or not policy_pairs(mission):
        return Connections()
    still = dynamics.rollout(np.zeros(dynamics.controls_shape))
    dt_fine = mission.horizon.duration / (len(still.q_fine) - 1)
    required, preferred = _constraints(mission, margins, dt_fine)
    if policy.graph == "every":
        return Connections((required,), tuple(preferred))
    return Connections((connected(required, still),), tuple(connected(item, still) for item in preferred))


def _constraints(mission: Mission, margins: Margins, dt_fine: float) -> tuple[PairConstraint, list[PairConstraint]]:
    """Of every pair of the policy: what is required, what is preferred."""
    policy = mission.connectivity
    pairs, names = np.array(policy_pairs(mission)), tuple(robot.name for robot in mission.robots)
    if isinstance(policy, ProbabilisticConnectivity):
        # A mission asks for P only; pairs that truly meet are what P is meant to bring about.
        indicator, nodes = Indicator(policy.indicator, policy.steepness), _nodes(mission, policy)
        exact = every_step(sub_period_steps(mission))
        threshold = _thresholds(mission, margins)
        connection = Connection(policy.range, threshold, pairs, nodes, exact, names, indicator)
        return connection, [Meeting(_ranges(mission, margins, pairs), pairs, nodes.nodes, names)]
    if isinstance(policy, SimultaneousConnectivity):
        indicator, exact = Indicator(policy.indicator, policy.steepness), every_step(sub_period_steps(mission))
        return Simultaneous(policy.range, _thresholds(mission, margins), pairs, exact, names, indicator), []
    ranges = _ranges(mission, margins, pairs)
    if isinstance(policy, PeriodicConnectivity):
        return Rendezvous(ranges, pairs, np.array(rendezvous_steps(mission, policy)), names, mission.horizon.dt), []
    if isinstance(policy, AllTimeConnectivity):
        return Contact(np.maximum(ranges, _given(mission, policy, pairs)), pairs, names, dt_fine), []
    if isinstance(policy, GuaranteedConnectivity):
        return _contact_time(mission, policy, margins, ranges), []
    raise TypeError(f"no constraints for policy {policy!r}")


def _thresholds(mission: Mission, margins: Margins) -> Array:
    """(pairs,) with the margin on top."""
    thresholds: Array = np.minimum(np.array(pair_thresholds(mission)) * (1.0 + margins.probability), 1.0)
    return thresholds


def _ranges(mission: Mission, margins: Margins, pairs: NDArray[np.intp]) -> Array:
    """(pairs,) range in the plane of the search [m]: less where robots fly at different altitudes."""
    R = mission.connectivity.range or 0.0
    reach = max(R - margins.range, 0.5 * R)
    if mission.dimension == 3:
        return np.full(len(pairs), reach)
    z = fleet.altitudes(mission)
    across = z[pairs[:, 0]] - z[pairs[:, 1]]
    planar: Array = np.sqrt(np.maximum(reach**2 - across**2, (0.01 * R) ** 2))
    return planar


def _given(mission: Mission, policy: AllTimeConnectivity, pairs: NDArray[np.intp]) -> Array:
    """(pairs,) distances no margin can shorten: of starts, and of ends that are given; 0 where out of range."""
    points = np.stack([fleet.starts(mission), fleet.ends(mission)])
    apart = np.linalg.norm(points[:, pairs[:, 0]] - points[:, pairs[:, 1]], axis=-1)
    given: Array = np.where(apart <= policy.range, apart, 0.0).max(axis=0)  # NaN, a free end, is never within range
    return given


def _contact_time(mission: Mission, policy: GuaranteedConnectivity, margins: Margins, ranges: Array) -> ContactTime:
    bounds = sub_period_steps(mission)
    shortest = min(end - first for first, end in bounds)
    steps = min(math.ceil((policy.duration + margins.contact) / mission.horizon.dt - 1e-9), shortest) + 1
    return ContactTime(
        range=ranges,
        pairs=np.array(policy_pairs(mission)),
        nodes=tuple(np.arange(first, end + 1) for first, end in bounds),
        steps=steps,
        contact=policy.contact,
        names=tuple(robot.name for robot in mission.robots),
    )


def _nodes(mission: Mission, policy: ProbabilisticConnectivity) -> Quadrature:
    """As few steps as the indicator's width allows at full speed."""
    width = policy.range / math.sqrt(max(policy.steepness, 1.0))
    stride = int(NODE_SPACING * width / (float(fleet.speeds(mission).max()) * mission.horizon.dt) + 1e-9)
    return thinned(sub_period_steps(mission), max(stride, 1))
