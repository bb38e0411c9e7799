"""Who connects with whom: the policy's checks, one of each kind, and the figures that are exact instead of sampled.

Probabilities are those of the planning step, by definition; distances, contacts and meetings are those of continuous
time.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from missions.connectivity import (
    AllTimeConnectivity,
    GuaranteedConnectivity,
    NoConnectivity,
    PeriodicConnectivity,
    ProbabilisticConnectivity,
    SimultaneousConnectivity,
)
from missions.schema import Mission
from missions.spanning import spanning_trees
from missions.topology import (
    components,
    pair_thresholds,
    policy_pairs,
    rendezvous_steps,
    sub_period_times,
)
from planner.certificate.bernstein import minimise, negative_root, square_sum
from planner.certificate.checks import DISTANCE_TOLERANCE, check, names_of
from planner.certificate.contacts import RESOLUTION as TIME_RESOLUTION
from planner.certificate.contacts import contacts_within, time_in_contact
from planner.certificate.record import Check, Indicators
from planner.certificate.segments import Segments, common_segments
from planner.certificate.separation import Approaches
from planner.connectivity.forwarding import Contact, by_pair
from planner.connectivity.pairs import all_pairs
from planner.indicators import indicators
from planner.trajectory.piecewise import PiecewisePolynomial

PROBABILITY_TOLERANCE = 1e-6
TIME_TOLERANCE = 1e-3  # [s]
RESOLUTION = 1e-4  # [m]
SHORTEST_GAP = 2.0 * TIME_RESOLUTION  # [s] between contacts: shorter ones may be the resolution's own


@dataclass(frozen=True)
class Evidence:
    """What the policy's checks look at.

    Attributes:
        segments: all robots on one time grid, cut at the sub-periods' boundaries.
        approaches: closest approaches of all pairs in every sub-period.
        found: indicators of what will fly.
        contacts: of all pairs, at the policy's range; empty without a range.
    """

    segments: Segments
    approaches: Approaches
    found: Indicators
    contacts: tuple[Contact, ...]


def period_boundaries(mission: Mission) -> Array:
    """(P+1,) boundaries of the sub-periods [s]; one period without a policy."""
    return np.array(sub_period_times(mission))


def gather(mission: Mission, flown: Sequence[PiecewisePolynomial], approaches: Approaches) -> Evidence:
    """Evidence from the polynomials.

    Args:
        mission: what was asked for.
        flown: all robots' polynomials.
        approaches: their closest approaches, true distances.
    """
    policy, breaks = mission.connectivity, period_boundaries(mission)
    if isinstance(policy, PeriodicConnectivity):
        breaks = np.concatenate([breaks, np.array(rendezvous_steps(mission, policy)) * mission.horizon.dt])
    segments = common_segments(flown, breaks)
    contacts = contacts_within(segments, policy.range) if policy.range is not None else ()
    found = _with_exact_meetings(mission, _at_planning_steps(mission, flown, contacts), approaches)
    return Evidence(segments, approaches, found, contacts)


def _at_planning_steps(
    mission: Mission, flown: Sequence[PiecewisePolynomial], contacts: tuple[Contact, ...]
) -> Indicators:
    """Indicators at the planning steps, where E and P are defined; contacts and arrivals are those of the proof."""
    t: Array = np.arange(mission.steps, dtype=np.float64) * mission.horizon.dt
    q = np.stack([trajectory.evaluate(t)[:, : mission.dimension] for trajectory in flown], axis=1)
    return indicators(mission, t, q, contacts)


def _with_exact_meetings(mission: Mission, sampled: Indicators, approaches: Approaches) -> Indicators:
    """Indicators whose meetings, shares and smallest distances are exact instead of sampled.

    A pair has met in a sub-period if it takes a distance within range; a distance is smallest by its proven bound.
    """
    reach, duration = mission.connectivity.range, mission.horizon.duration
    pairs = []
    for pair, bound, attained in zip(sampled.pairs, approaches.bound, approaches.attained, strict=True):
        pair = replace(pair, smallest_distance=float(bound.min()))
        if reach is not None:
            met = tuple(bool(d <= reach) for d in attained)
            share = sum(end - begin for begin, end in pair.contacts) / duration
            pair = replace(pair, met=met, connected_share=share)
        pairs.append(pair)
    shares = [pair.connected_share for pair in pairs]
    return replace(
        sampled,
        pairs=tuple(pairs),
        connected_share=float(np.mean(shares)) if shares else np.nan,
        all_met=all(all(pair.met) for pair in pairs),
        smallest_separation=min((pair.smallest_distance for pair in pairs), default=np.inf),
    )


# ------------------------------------------------------------------------------------------------ the checks


def connection_checks(mission: Mission, evidence: Evidence) -> list[Check]:
    """Every check of the mission's policy; its worst pair, slot of time and value."""
    policy = mission.connectivity
    if isinstance(policy, NoConnectivity) or not policy_pairs(mission):
        return []
    if isinstance(policy, ProbabilisticConnectivity):
        P = np.array([pair.probability for pair in evidence.found.pairs])
        return [_probability(mission, "connection probability", P), _meeting(mission, policy, evidence)]
    if isinstance(policy, SimultaneousConnectivity):
        P = np.array([pair.same_time_probability for pair in evidence.found.pairs])
        return [_probability(mission, "same-time connection probability", P)]
    if isinstance(policy, PeriodicConnectivity):
        return [_rendezvous(mission, policy, evidence.segments)]
    if isinstance(policy, AllTimeConnectivity):
        return [_all_time(mission, policy, evidence.segments)]
    return [_contact(mission, policy, evidence.contacts)]


@dataclass(frozen=True)
class _Slots:
    """Values (pairs, slots) of the policy's pairs, and which of them decides."""

    mission: Mission

    def rows(self) -> NDArray[np.intp]:
        """Rows of the policy's pairs among all pairs."""
        index = {(int(i), int(j)): row for row, (i, j) in enumerate(all_pairs(len(self.mission.robots)))}
        return np.array([index[pair] for pair in policy_pairs(self.mission)])

    def decisive(self, badness: Array) -> tuple[int, int]:
        """Pair and slot with the largest badness; of a connected graph only along the best trees."""
        policy = self.mission.connectivity
        if getattr(policy, "graph", "every") == "connected":
            tree = spanning_trees(badness, policy_pairs(self.mission), len(self.mission.robots))
            badness = np.where(tree, badness, -np.inf)
        row, slot = np.unravel_index(int(np.argmax(badness)), badness.shape)
        return int(row), int(slot)

    def where(self, row: int, slot: int | None = None) -> str:
        """The pair's names, the sub-period (counted from 1)."""
        i, j = policy_pairs(self.mission)[row]
        names = names_of((i, j), [robot.name for robot in self.mission.robots])
        return names if slot is None else f"{names}, sub-period {slot + 1}"


def _probability(mission: Mission, name: str, probabilities: Array) -> Check:
    slots, thresholds = _Slots(mission), np.array(pair_thresholds(mission))
    P = probabilities[slots.rows()]
    row, period = slots.decisive(thresholds[:, None] / np.maximum(P, 1e-300))
    where = slots.where(row, period)
    return check(name, P[row, period], thresholds[row], "", ">=", where, tolerance=PROBABILITY_TOLERANCE)


def _meeting(mission: Mission, policy: ProbabilisticConnectivity, evidence: Evidence) -> Check:
    """That pairs do not only connect on paper."""
    slots = _Slots(mission)
    rows = slots.rows()
    attained, time = evidence.approaches.attained[rows], evidence.approaches.time[rows]
    row, period = slots.decisive(attained)
    where = slots.where(row, period)
    return _within("meeting", float(attained[row, period]), policy.range, where, float(time[row, period]))


def _within(name: str, distance: float, limit: float, where: str, time: float | None) -> Check:
    return check(name, distance, limit, "m", "<=", where, time, DISTANCE_TOLERANCE)


def _rendezvous(mission: Mission, policy: PeriodicConnectivity, segments: Segments) -> Check:
    """Distances at the instants themselves."""
    slots = _Slots(mission)
    times = np.array(rendezvous_steps(mission, policy)) * mission.horizon.dt
    q = positions_at(segments, times)  # (N, instants, 3)
    pairs = np.array(policy_pairs(mission))
    distance = np.linalg.norm(q[pairs[:, 0]] - q[pairs[:, 1]], axis=-1)
    row, slot = slots.decisive(distance)
    return _within("rendezvous", float(distance[row, slot]), policy.range, slots.where(row), float(times[slot]))


def positions_at(segments: Segments, times: Array) -> Array:
    """(N, len(times), 3) positions at times that are boundaries of segments, to a nanosecond [m]."""
    index = np.abs(segments.times[:, None] - times).argmin(axis=0)
    first = index < len(segments.times) - 1
    begin = segments.points[..., 0][:, np.minimum(index, len(segments.times) - 2)]
    end = segments.points[..., -1][:, np.maximum(index - 1, 0)]
    return np.where(first[:, None], begin, end)


def _all_time(mission: Mission, policy: AllTimeConnectivity, segments: Segments) -> Check:
    slots, pairs = _Slots(mission), np.array(policy_pairs(mission))
    relative = segments.points[pairs[:, 0]] - segments.points[pairs[:, 1]]
    points = -square_sum(relative).reshape(-1, 15)
    count, pieces = relative.shape[:2]
    start, end = np.tile(segments.times[:-1], count), np.tile(segments.times[1:], count)
    group = np.repeat(np.arange(count), pieces)
    farthest = minimise(points, start, end, group, count, RESOLUTION, negative_root)
    if policy.graph == "every":
        row, _ = slots.decisive(-farthest.bound[:, None])
        return _within(
            "contact at all times", -farthest.bound[row], policy.range, slots.where(row), float(farthest.time[row])
        )
    allowed = {tuple(pair) for pair in pairs.tolist()}

    def gap(reach: float) -> float | None:
        contacts = [c for c in contacts_within(segments, reach) if (c.i, c.j) in allowed]
        return first_disconnection(len(mission.robots), contacts, float(segments.times[-1]))

    needed = _smallest(lambda reach: gap(reach) is None, policy.range, float(-farthest.bound.min()))
    return _within("contact at all times", needed, policy.range, "all robots", gap(needed - 2.0 * RESOLUTION))


def first_disconnection(robots: int, contacts: Sequence[Contact], duration: float) -> float | None:
    """Earliest time [s] at which the graph of contacts does not connect all robots; None if it always does.

    Contacts are known to the certificate's resolution; what is shorter than that resolution is no disconnection.
    """
    edges = np.unique([0.0, duration, *(t for c in contacts for t in (c.begin, c.end) if 0.0 < t < duration)])
    for begin, end in itertools.pairwise(edges):
        if end - begin <= SHORTEST_GAP:
            continue
        middle = 0.5 * (begin + end)
        if len(components(robots, [(c.i, c.j) for c in contacts if c.begin <= middle <= c.end])) > 1:
            return float(begin)
    return None


def _smallest(holds: Callable[[float], bool], guess: float, largest: float) -> float:
    """Smallest value in [0, largest] from which on a condition holds, to RESOLUTION; ``guess`` is tried first."""
    low, high = (0.0, guess) if holds(guess) else (guess, max(largest, guess))
    while high - low > RESOLUTION:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def _contact(mission: Mission, policy: GuaranteedConnectivity, contacts: Sequence[Contact]) -> Check:
    """Time in contact, by proven intervals."""
    slots, times = _Slots(mission), sub_period_times(mission)
    mode = 0 if policy.contact == "single" else 1
    spans = list(itertools.pairwise(times))
    own = by_pair(contacts)
    lengths = np.array(
        [[time_in_contact(own.get(pair, ()), *span)[mode] for span in spans] for pair in policy_pairs(mission)]
    )
    row, period = slots.decisive(-lengths)
    where = slots.where(row, period)
    return check("contact", lengths[row, period], policy.duration, "s", ">=", where, tolerance=TIME_TOLERANCE)
