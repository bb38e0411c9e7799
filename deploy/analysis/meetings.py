"""Who was within communication range of whom, and when."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from missions.schema import Mission
from planner.certificate.record import Indicators
from planner.trajectory.piecewise import PiecewisePolynomial

Intervals = tuple[tuple[float, float], ...]
_RATE = 20.0  # Hz


@dataclass(frozen=True)
class PairMeetings:
    """One pair.

    Attributes:
        robots: names.
        certified, flown: times [s] of the search during which they were within range, by plan and in flight.
        probability_certified, probability_flown: P per sub-period; empty where not defined or not flown.
        met: per sub-period, whether they truly met in flight; empty when not flown.
    """

    robots: tuple[str, str]
    certified: Intervals
    flown: Intervals
    probability_certified: tuple[float, ...]
    probability_flown: tuple[float, ...]
    met: tuple[bool, ...]


def meetings(
    mission: Mission,
    references: Mapping[str, PiecewisePolynomial],
    flown: tuple[Array, Array] | None,
    certified_indicators: Indicators,
    flown_indicators: Indicators | None,
) -> tuple[PairMeetings, ...]:
    """Every pair's meetings; none when the mission names no range. ``flown``: mission times and positions."""
    reach = mission.connectivity.range
    if reach is None:
        return ()
    names = [robot.name for robot in mission.robots]
    t = np.arange(0.0, mission.horizon.duration + 1e-9, 1.0 / _RATE)
    planned = np.stack([references[name].evaluate(t)[:, :3] for name in names], axis=1)
    certified_pairs = {pair.robots: pair for pair in certified_indicators.pairs}
    flown_pairs = {pair.robots: pair for pair in flown_indicators.pairs} if flown_indicators else {}
    out = []
    for i, j in itertools.combinations(range(len(names)), 2):
        robots = (names[i], names[j])
        by_plan, in_flight = certified_pairs.get(robots), flown_pairs.get(robots)
        out.append(
            PairMeetings(
                robots=robots,
                certified=_within(t, planned[:, i], planned[:, j], reach),
                flown=_within(flown[0], flown[1][:, i], flown[1][:, j], reach) if flown else (),
                probability_certified=by_plan.probability if by_plan else (),
                probability_flown=in_flight.probability if in_flight else (),
                met=in_flight.met if in_flight else (),
            )
        )
    return tuple(out)


def _within(t: Array, a: Array, b: Array, reach: float) -> Intervals:
    """Times between which two are within reach; a moment nobody saw is not a meeting."""
    if len(t) == 0:
        return ()
    near = np.linalg.norm(a - b, axis=1) <= reach  # NaN compares false
    edges = np.flatnonzero(np.diff(np.concatenate([[False], near, [False]]).astype(np.int8)))
    return tuple((float(t[begin]), float(t[end - 1])) for begin, end in zip(edges[::2], edges[1::2], strict=True))
