"""What a certificate says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Check:
    """One line of a certificate.

    Attributes:
        name: what was checked, e.g. ``separation``.
        value: worst value found. limit: what is allowed. unit: of both.
        relation: how value has to stand to limit.
        passed: whether it does.
        where: robot, pair or obstacle it was found at.
        time: time of the worst value [s] since the start of the search; None if it has none.
        tolerance: how far value may be on the wrong side of limit and still pass (numerics, not safety).
    """

    name: str
    value: float
    limit: float
    unit: str
    relation: Literal["<=", ">="]
    passed: bool
    where: str = ""
    time: float | None = None
    tolerance: float = 0.0


@dataclass(frozen=True)
class PairConnection:
    """Who met whom.

    Attributes:
        robots: names of the pair.
        probability: P per sub-period (IMEC Eq. 8, all pairs of times, at the planning step).
        met: per sub-period, whether they were within range at the same time at least once.
        connected_share: share of the time they were within range.
        smallest_distance: [m], over the whole search.
        same_time_probability: P̃ per sub-period (IMEC Eq. 29, at the planning step).
        contacts: (begin, end) of every interval within range [s].
    """

    robots: tuple[str, str]
    probability: tuple[float, ...]
    met: tuple[bool, ...]
    connected_share: float
    smallest_distance: float
    same_time_probability: tuple[float, ...] = ()
    contacts: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Indicators:
    """The figures the papers report, for whatever motion they were computed from."""

    ergodicity: float
    connected_share: float  # R_c ratio: share of pair-times within R_c; NaN without a range
    probability_worst: float  # NaN without a policy that defines it
    probability_mean: float
    all_met: bool  # every pair truly within R_c at once in every sub-period
    smallest_separation: float  # [m], inf for one robot
    smallest_clearance: float  # [m] to obstacles, inf without any
    pairs: tuple[PairConnection, ...] = ()
    # Store and forward: [i][j] when i's data reach j at the earliest [s]; inf if they never do; empty without a range.
    arrivals: tuple[tuple[float, ...], ...] = ()  # data of t = 0
    arrivals_by_period: tuple[tuple[tuple[float, ...], ...], ...] = ()  # data of a sub-period's start, within it


@dataclass(frozen=True)
class Certificate:
    """Proof that these bytes respect this mission.

    Attributes:
        checks: every check that was made.
        indicators: figures of what will fly.
        mission_sha256: mission it was made for. trajectories_sha256: the bytes it was made for, by robot.
    """

    checks: tuple[Check, ...]
    indicators: Indicators
    mission_sha256: str
    trajectories_sha256: tuple[tuple[str, str], ...]

    @property
    def passed(self) -> bool:
        """Whether every check passed."""
        return all(check.passed for check in self.checks)
