"""What no plan can beat: an upper bound of a pair's connection probability in the first sub-period.

From rest, with |u| ≤ a per axis (so a √ν in all) and speed v, a robot is within r(t) = ½ a √ν t² of its start, and
within v t − v²/(2 a √ν) once it has reached v. Two robots that start d apart are therefore at least d − r(t) − r(s)
apart at times t and s, and at equal times at least the separation. With Γ falling with distance,

    P = n⁻² Σ_t Σ_s Γ(|q_i(t) − q_j(s)|) ≤ n⁻² Σ_t Σ_s Γ(max(d − r(t) − r(s), separation if t = s else 0)).
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from missions.arrays import Array
from missions.schema import Mission, ProbabilisticConnectivity

_BLOCKS = 300  # long sub-periods are bounded block by block, by the latest step of each


def best_probability(mission: Mission, policy: ProbabilisticConnectivity) -> tuple[float, int, int]:
    """Upper bound of P in the first sub-period, for the pair that starts farthest apart.

    Args:
        mission: with at least two robots; steps divisible by the sub-periods.
        policy: the mission's connectivity.

    Returns:
        The bound and the two robots' indices. Every other pair's bound is at least as large.
    """
    robots = mission.robots
    distance, i, j = max(
        (math.dist(a.start, b.start), i, j) for (i, a), (j, b) in itertools.combinations(enumerate(robots), 2)
    )
    n = mission.steps // policy.sub_periods
    blocks = np.array_split(np.arange(n), min(n, _BLOCKS))
    weight = np.array([len(block) for block in blocks]) / n
    r = _reach(mission, np.array([block[-1] for block in blocks]) * mission.horizon.dt)
    nearest = np.maximum(distance - r[:, None] - r[None, :], 0.0)
    gamma = np.exp(-(nearest**2) / (2.0 * policy.range**2))  # IMEC's Gaussian indicator
    bound = float(weight @ gamma @ weight)
    # Of the n² pairs of times n are equal times, where the separation holds.
    apart = math.exp(-(mission.limits.separation**2) / (2.0 * policy.range**2))
    return min(bound, 1.0 - (1.0 - apart) / n), i, j


def _reach(mission: Mission, t: Array) -> Array:
    a = mission.limits.acceleration * math.sqrt(mission.dimension)
    v = mission.limits.speed
    return np.where(t < v / a, 0.5 * a * t**2, v * t - v**2 / (2.0 * a))
