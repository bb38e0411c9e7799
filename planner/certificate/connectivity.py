"""Who connects with whom: P at the planning step, meetings in continuous time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from missions.arrays import Array
from missions.schema import Mission, ProbabilisticConnectivity
from planner.certificate.record import Indicators
from planner.certificate.separation import Approaches
from planner.connectivity.pairs import sub_period_bounds


def period_boundaries(mission: Mission) -> Array:
    """(P+1,) boundaries of the sub-periods [s]; one period without a policy."""
    policy = mission.connectivity
    periods = policy.sub_periods if isinstance(policy, ProbabilisticConnectivity) else 1
    bounds = sub_period_bounds(mission.steps, periods)
    return np.array([0, *(end for _, end in bounds)]) * mission.horizon.dt


def with_exact_meetings(mission: Mission, indicators: Indicators, approaches: Approaches) -> Indicators:
    """Indicators whose meetings and smallest distances are exact instead of sampled.

    A pair has met in a sub-period if it takes a distance within range; a distance is smallest by its proven bound.
    """
    reach = mission.connectivity.range
    pairs = tuple(
        replace(
            pair,
            met=tuple(bool(d <= reach) for d in attained) if reach is not None else pair.met,
            smallest_distance=float(bound.min()),
        )
        for pair, bound, attained in zip(indicators.pairs, approaches.bound, approaches.attained, strict=True)
    )
    return replace(
        indicators,
        pairs=pairs,
        all_met=all(all(pair.met) for pair in pairs),
        smallest_separation=min((pair.smallest_distance for pair in pairs), default=np.inf),
    )
