"""Checks of the connectivity policy against the rest of the mission."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

from missions import fleet
from missions.connectivity import (
    GuaranteedConnectivity,
    NoConnectivity,
    Pairs,
    PeriodicConnectivity,
    ProbabilisticConnectivity,
    SimultaneousConnectivity,
    SubPeriods,
)
from missions.errors import MissionError
from missions.reach import shortfall
from missions.records import did_you_mean
from missions.schema import Mission
from missions.topology import components, policy_pairs, sub_period_times

ErrorAt = Callable[[str, str], MissionError]


def check_connectivity(mission: Mission, error: ErrorAt) -> None:
    """Check pairs, sub-periods and thresholds, and that no pair is provably unable to connect.

    Raises:
        MissionError: the first thing found wrong.
    """
    policy = mission.connectivity
    if isinstance(policy, NoConnectivity):
        return
    _check_pairs(mission, policy, error)
    if isinstance(policy, SubPeriods):
        _check_sub_periods(mission, policy, error)
    if isinstance(policy, PeriodicConnectivity):
        _check_instants(mission, policy.instants, "connectivity.instants", error, last=True)
    if isinstance(policy, GuaranteedConnectivity):
        _check_duration(mission, policy, error)
    if len(mission.robots) < 2:
        return
    if isinstance(policy, ProbabilisticConnectivity | SimultaneousConnectivity):
        _check_thresholds(mission, policy, error)
    if policy.range <= mission.limits.separation and not fleet.at_different_heights(mission):
        reason = f"got {policy.range:g}; allowed: above the separation of {mission.limits.separation:g} [m]"
        raise error(reason + ", or nobody may ever be within range", "connectivity.range")
    _check_reach(mission, error)


# --------------------------------------------------------------------------------------------------------- pairs


def _check_pairs(mission: Mission, policy: Pairs, error: ErrorAt) -> None:
    names = [robot.name for robot in mission.robots]
    if policy.pairs == "star" or policy.hub:
        if policy.pairs != "star":
            raise error("a hub is for 'pairs: star' only", "connectivity.hub")
        _check_name(policy.hub, names, "connectivity.hub", error)
    if isinstance(policy.pairs, tuple):
        seen: dict[frozenset[str], int] = {}
        for k, pair in enumerate(policy.pairs):
            where = f"connectivity.pairs[{k}]"
            _check_pair(pair, names, where, error)
            if frozenset(pair) in seen:
                raise error(f"the same pair as pairs[{seen[frozenset(pair)]}]; allowed: each pair once", where)
            seen[frozenset(pair)] = k
    groups = components(len(names), policy_pairs(mission))
    if getattr(policy, "graph", "") == "connected" and len(groups) > 1:
        first, second = (names[group[0]] for group in groups[:2])
        reason = f"no chain of the pairs leads from {first} to {second}; allowed: pairs that can connect all robots"
        raise error(reason, "connectivity.pairs")


def _check_pair(pair: tuple[str, ...], names: list[str], where: str, error: ErrorAt) -> None:
    if len(pair) != 2:
        raise error(f"got {len(pair)} names; allowed: 2", where)
    for side, name in enumerate(pair):
        _check_name(name, names, f"{where}[{side}]", error)
    if pair[0] == pair[1]:
        raise error(f"got {pair[0]!r} twice; allowed: two robots", where)


def _check_name(name: str, names: list[str], where: str, error: ErrorAt) -> None:
    if name not in names:
        raise error(f"got {name!r}; allowed: {', '.join(names)}{did_you_mean(name, names)}", where)


def _check_thresholds(
    mission: Mission, policy: ProbabilisticConnectivity | SimultaneousConnectivity, error: ErrorAt
) -> None:
    names = [robot.name for robot in mission.robots]
    chosen = {frozenset((names[i], names[j])) for i, j in policy_pairs(mission)}
    seen: dict[frozenset[str], int] = {}
    for k, item in enumerate(policy.thresholds):
        where = f"connectivity.thresholds[{k}].pair"
        _check_pair(item.pair, names, where, error)
        pair = frozenset(item.pair)
        if pair not in chosen:
            raise error(f"got {'-'.join(item.pair)}; allowed: a pair that 'pairs' asks to connect", where)
        if pair in seen:
            raise error(f"the same pair as thresholds[{seen[pair]}]; allowed: each pair once", where)
        seen[pair] = k


# --------------------------------------------------------------------------------------------------- sub-periods


def _check_sub_periods(mission: Mission, policy: SubPeriods, error: ErrorAt) -> None:
    if policy.boundaries:
        _check_instants(mission, policy.boundaries, "connectivity.boundaries", error, last=False)
        count = len(policy.boundaries) + 1
        if policy.sub_periods not in (1, count):
            raise error(f"got {policy.sub_periods}; {count - 1} boundaries make {count}", "connectivity.sub_periods")
    elif mission.steps % policy.sub_periods:
        near = [n for n in range(1, mission.steps + 1) if mission.steps % n == 0]
        near = sorted(sorted(near, key=lambda n: abs(n - policy.sub_periods))[:3])
        allowed = f"a divisor of the {mission.steps} steps, e.g. {', '.join(map(str, near))}"
        raise error(f"got {policy.sub_periods}; allowed: {allowed}", "connectivity.sub_periods")


def _check_instants(mission: Mission, instants: tuple[float, ...], where: str, error: ErrorAt, *, last: bool) -> None:
    """Increasing whole multiples of dt inside the horizon, its end allowed if ``last``."""
    dt, before = mission.horizon.dt, 0
    for k, t in enumerate(instants):
        step = round(t / dt)
        if not math.isclose(t, step * dt, rel_tol=1e-9, abs_tol=1e-9):
            raise error(f"got {t:g}; allowed: a whole multiple of dt = {dt:g} [s]", f"{where}[{k}]")
        if step <= before:
            raise error(f"got {t:g}; allowed: above {before * dt:g} [s], increasing", f"{where}[{k}]")
        if step > mission.steps or (step == mission.steps and not last):
            bound = "at most" if last else "below"
            reason = f"got {t:g}; allowed: {bound} the duration of {mission.horizon.duration:g} [s]"
            raise error(reason, f"{where}[{k}]")
        before = step


def _check_duration(mission: Mission, policy: GuaranteedConnectivity, error: ErrorAt) -> None:
    times = sub_period_times(mission)
    shortest = min(b - a for a, b in itertools.pairwise(times))
    if policy.duration > shortest + 1e-9:
        reason = f"got {policy.duration:g}; allowed: at most {shortest:g} [s], the shortest sub-period"
        raise error(reason, "connectivity.duration")


# --------------------------------------------------------------------------------------------------------- reach


def _check_reach(mission: Mission, error: ErrorAt) -> None:
    missed = shortfall(mission)
    if missed is None:
        return
    i, j = (mission.robots[k].name for k in missed.pair)
    unit = f" {missed.unit}" if missed.unit else ""
    best = f"reach at most {missed.bound:.2g}" if not missed.unit else f"do no better than {missed.bound:.2g}{unit}"
    where = f"in {missed.place}" if missed.place.startswith("sub-period") else missed.place
    reason = f"got {missed.required:g}; {i} and {j} can {best} {where}: {missed.reason}"
    raise error(reason, f"connectivity.{missed.setting}")
