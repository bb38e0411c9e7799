"""What no plan can beat: how soon, how surely and how long two robots can be in contact at best.

With |u| ≤ a per axis (so a √ν in all) and speed v, a robot that starts at rest is within r(t) = ½ a √ν t² of its
start, and within v t − v²/(2 a √ν) once it has reached v. Two robots that start d apart are therefore at least
d − r(t) − r(s) apart at times t and s, and at equal times at least the separation. Everything here follows from that;
all bounds are hardest in the first sub-period, because r grows.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

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
from missions.dynamics import flies
from missions.indicator import Indicator
from missions.schema import Mission
from missions.spanning import bottlenecks
from missions.topology import pair_thresholds, policy_pairs, rendezvous_steps, sub_period_steps

_BLOCKS = 300  # long sub-periods are bounded block by block, by the latest step of each
_BISECTIONS = 60
_SLACK = 1e-9  # [m] rounding allowed where a start may lie on a limit


class Shortfall(NamedTuple):
    """A connection that no motion of the robots can make.

    Attributes:
        constraint: which, e.g. ``connection``. setting: the policy's setting that asks for it.
        pair: robot indices. place: sub-period or instant, in words.
        bound: the best any motion can do. required: what is asked for. unit: of both.
        reason: why, in words.
    """

    constraint: str
    setting: str
    pair: tuple[int, int]
    place: str
    bound: float
    required: float
    unit: str
    reason: str


def shortfall(mission: Mission) -> Shortfall | None:
    """The connection of the mission's policy that is provably out of reach; None if none is."""
    policy = mission.connectivity
    if len(mission.robots) < 2 or isinstance(policy, NoConnectivity) or not policy_pairs(mission):
        return None
    if isinstance(policy, ProbabilisticConnectivity | SimultaneousConnectivity):
        return _probability_shortfall(mission, policy)
    if isinstance(policy, GuaranteedConnectivity):
        return _duration_shortfall(mission, policy)
    if isinstance(policy, PeriodicConnectivity):
        t = rendezvous_steps(mission, policy)[0] * mission.horizon.dt
        return _distance_shortfall(mission, policy, t, "rendezvous")
    return _distance_shortfall(mission, policy, 0.0, "contact at all times")


def reach(mission: Mission, t: Array) -> Array:
    """Largest distance [m] from its start that the fastest of the robots can have at times t [s]."""
    a = float(fleet.accelerations(mission).max()) * math.sqrt(mission.dimension)
    v = float(fleet.speeds(mission).max())
    if not flies(mission.dynamics):  # other models are bound by speed alone
        return np.asarray(v * t)
    v_0 = min(float(np.linalg.norm(fleet.velocities(mission), axis=-1).max()), v)
    ramp = (v - v_0) / a
    distance: Array = np.where(t < ramp, (v_0 + 0.5 * a * t) * t, v * t - 0.5 * a * ramp**2)
    return distance


def best_probability(
    mission: Mission,
    policy: ProbabilisticConnectivity | SimultaneousConnectivity,
    pair: tuple[int, int] | None = None,
) -> tuple[float, int, int]:
    """Upper bound of a pair's connection probability in the first sub-period.

    With Γ falling with distance, P = n⁻² Σ_t Σ_s Γ(|q_i(t) − q_j(s)|) ≤ n⁻² Σ_t Σ_s Γ(max(d − r(t) − r(s), ε_a if
    t = s else 0)), and the same-time variant P̃ = n⁻¹ Σ_t Γ(|q_i(t) − q_j(t)|) likewise.

    Args:
        mission: with at least two robots.
        policy: the mission's connectivity.
        pair: robot indices; default: of the policy's pairs the one that starts farthest apart, whose bound is the
            smallest.

    Returns:
        The bound and the two robots' indices.
    """
    i, j = pair or max(policy_pairs(mission), key=lambda ij: _start_distance(mission, *ij))
    first, end = sub_period_steps(mission)[0]
    n = end - first
    blocks = np.array_split(np.arange(n), min(n, _BLOCKS))
    weight = np.array([len(block) for block in blocks]) / n
    r = reach(mission, np.array([block[-1] for block in blocks]) * mission.horizon.dt)
    gamma = Indicator(policy.indicator, policy.steepness)
    distance = _start_distance(mission, i, j)
    apart = 0.0 if fleet.at_different_heights(mission) else mission.limits.separation
    if isinstance(policy, SimultaneousConnectivity):
        return float(weight @ gamma(np.maximum(distance - 2.0 * r, apart), policy.range)), i, j
    bound = float(weight @ gamma(np.maximum(distance - r[:, None] - r[None, :], 0.0), policy.range) @ weight)
    # Of the n² pairs of times n are equal times, where the separation holds.
    touching, separate = gamma(np.array([0.0, apart]), policy.range)
    return min(bound, float(touching - (touching - separate) / n)), i, j


def _start_distance(mission: Mission, i: int, j: int) -> float:
    """Distance of two starts in the plane of the search [m]."""
    return math.dist(mission.robots[i].start, mission.robots[j].start)


def _hardest(mission: Mission, weights: Array, graph: str) -> int:
    """Row of the pair whose weight decides: the largest, or of a connected graph that of the easiest tree."""
    if graph == "connected":
        return int(bottlenecks(weights[:, None], policy_pairs(mission), len(mission.robots))[0])
    return int(weights.argmax())


def _probability_shortfall(
    mission: Mission, policy: ProbabilisticConnectivity | SimultaneousConnectivity
) -> Shortfall | None:
    pairs, thresholds = policy_pairs(mission), np.array(pair_thresholds(mission))
    distances = np.array([_start_distance(mission, i, j) for i, j in pairs])
    if policy.graph == "connected":  # somebody has to bridge the widest gap, at the least threshold there is
        candidates = [(_hardest(mission, distances, policy.graph), float(thresholds.min()))]
    else:
        candidates = [
            (int(np.where(thresholds == threshold, distances, -1.0).argmax()), float(threshold))
            for threshold in np.unique(thresholds)
        ]
    for row, threshold in candidates:
        bound, i, j = best_probability(mission, policy, pairs[row])
        if bound < threshold:
            t = sub_period_steps(mission)[0][1] * mission.horizon.dt
            reason = f"they start {distances[row]:.2f} m apart and the sub-period ends at {t:g} s"
            name = "connection" if isinstance(policy, ProbabilisticConnectivity) else "same-time connection"
            return Shortfall(name, "threshold", (i, j), "sub-period 1", bound, threshold, "", reason)
    return None


def _gaps(mission: Mission) -> tuple[Array, Array]:
    """Of every pair: distance of the starts in the plane of the search, and constant distance across it [m]."""
    pairs = np.array(policy_pairs(mission))
    start = fleet.starts(mission)
    along = np.linalg.norm(start[pairs[:, 0]] - start[pairs[:, 1]], axis=-1)
    if mission.dimension == 3:
        return along, np.zeros_like(along)
    z = fleet.altitudes(mission)
    return along, np.abs(z[pairs[:, 0]] - z[pairs[:, 1]])


def _distance_shortfall(
    mission: Mission, policy: PeriodicConnectivity | AllTimeConnectivity, t: float, constraint: str
) -> Shortfall | None:
    """Whether pairs can be in contact at time t [s]."""
    along, across = _gaps(mission)
    nearest = np.hypot(np.maximum(along - 2.0 * reach(mission, np.array(t)), 0.0), across)
    row = _hardest(mission, nearest, policy.graph)
    if nearest[row] <= policy.range + _SLACK:
        return None
    reason = f"they start {np.hypot(along, across)[row]:.2f} m apart and have {t:g} s to come together"
    pair, bound = policy_pairs(mission)[row], float(nearest[row])
    return Shortfall(constraint, "range", pair, f"at {t:g} s", bound, policy.range, "m", reason)


def _duration_shortfall(mission: Mission, policy: GuaranteedConnectivity) -> Shortfall | None:
    """Whether pairs can be in contact early enough in the first sub-period to stay for the duration."""
    along, across = _gaps(mission)
    end = sub_period_steps(mission)[0][1] * mission.horizon.dt
    to_go = along - np.sqrt(np.maximum(policy.range**2 - across**2, 0.0)) + np.where(across > policy.range, np.inf, 0.0)
    row = _hardest(mission, to_go, policy.graph)
    earliest = _first_time(lambda t: 2.0 * float(reach(mission, np.array(t))) >= to_go[row] - _SLACK, end)
    if end - earliest >= policy.duration - _SLACK:
        return None
    reason = f"they start {np.hypot(along, across)[row]:.2f} m apart and the sub-period ends at {end:g} s"
    pair = policy_pairs(mission)[row]
    return Shortfall("contact", "duration", pair, "sub-period 1", end - earliest, policy.duration, "s", reason)


def _first_time(reached: Callable[[float], bool], end: float) -> float:
    """Earliest time in [0, end] at which a monotone condition holds, never too late; ``end`` if it never does."""
    if reached(0.0):
        return 0.0
    low, high = 0.0, end
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if reached(middle) else (middle, high)
    return low if reached(end) else end
