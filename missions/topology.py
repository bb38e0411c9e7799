"""What a connectivity policy speaks of, worked out: pairs of robots as indices, sub-periods as steps and as seconds."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence

from missions.connectivity import (
    NoConnectivity,
    Pairs,
    PeriodicConnectivity,
    ProbabilisticConnectivity,
    SimultaneousConnectivity,
    SubPeriods,
)
from missions.schema import Mission

Pair = tuple[int, int]


def policy_pairs(mission: Mission) -> tuple[Pair, ...]:
    """Robot indices i < j of the policy's pairs, in lexicographic order; none without a policy.

    Raises:
        KeyError: a name in the policy is no robot's (the loader refuses such files).
    """
    policy, count = mission.connectivity, len(mission.robots)
    if isinstance(policy, NoConnectivity):
        return ()
    index = {robot.name: i for i, robot in enumerate(mission.robots)}
    return tuple(sorted({_ordered(i, j) for i, j in _edges(policy, index, count) if i != j}))


def _edges(policy: Pairs, index: dict[str, int], count: int) -> Iterable[Pair]:
    if isinstance(policy.pairs, tuple):
        return [(index[a], index[b]) for a, b in policy.pairs]
    if policy.pairs == "all":
        return itertools.combinations(range(count), 2)
    if policy.pairs == "star":
        return [(index[policy.hub], i) for i in range(count)]
    chain = list(itertools.pairwise(range(count)))
    return [*chain, (count - 1, 0)] if policy.pairs == "ring" and count > 2 else chain


def _ordered(i: int, j: int) -> Pair:
    return (i, j) if i < j else (j, i)


def pair_thresholds(mission: Mission) -> tuple[float, ...]:
    """Least connection probability of every pair of :func:`policy_pairs`; none for policies without."""
    policy = mission.connectivity
    if not isinstance(policy, ProbabilisticConnectivity | SimultaneousConnectivity):
        return ()
    index = {robot.name: i for i, robot in enumerate(mission.robots)}
    own = {_ordered(*(index[name] for name in item.pair)): item.threshold for item in policy.thresholds}
    return tuple(own.get(pair, policy.threshold) for pair in policy_pairs(mission))


def sub_period_steps(mission: Mission) -> tuple[tuple[int, int], ...]:
    """First step and end (exclusive) of every sub-period; one for policies without sub-periods."""
    policy, steps = mission.connectivity, mission.steps
    if not isinstance(policy, SubPeriods):
        return ((0, steps),)
    if policy.boundaries:
        edges = [0, *(round(t / mission.horizon.dt) for t in policy.boundaries), steps]
    else:
        edges = [round(p * steps / policy.sub_periods) for p in range(policy.sub_periods + 1)]
    return tuple(itertools.pairwise(edges))


def sub_period_times(mission: Mission) -> tuple[float, ...]:
    """The sub-periods' ends and beginnings [s]: one more than there are sub-periods, from 0 to the duration."""
    return (0.0, *(end * mission.horizon.dt for _, end in sub_period_steps(mission)))


def rendezvous_steps(mission: Mission, policy: PeriodicConnectivity) -> tuple[int, ...]:
    """Steps at which pairs have to be in contact."""
    if policy.instants:
        return tuple(round(t / mission.horizon.dt) for t in policy.instants)
    return tuple(end for _, end in sub_period_steps(mission))


def components(count: int, pairs: Iterable[Sequence[int]]) -> list[list[int]]:
    """Connected components of robots 0 .. count−1 under ``pairs``, each ascending, in order of their first robot."""
    label = list(range(count))
    for i, j in pairs:
        a, b = label[i], label[j]
        if a != b:
            label = [min(a, b) if x in (a, b) else x for x in label]
    return [[i for i in range(count) if label[i] == root] for root in sorted(set(label))]
