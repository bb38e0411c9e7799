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
        passed: whether it does, up to the tolerance.
        where: robot, pair or obstacle it was found at.
        time: time of the worst value [s] since the start of the search; None if it has none.
        tolerance: how far value may be on the wrong side of limit and still pass (numerics, not safety).
        severity: a ``failure`` voids the certificate; a ``warning`` is advice: worse flying, not danger.
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
    severity: Literal["failure", "warning"] = "failure"

    @property
    def margin(self) -> float:
        """How far the value is on the right side of the limit, in the check's unit; negative on the wrong one."""
        return self.limit - self.value if self.relation == "<=" else self.value - self.limit

    @property
    def fails(self) -> bool:
        """Whether this check voids the certificate."""
        return not self.passed and self.severity == "failure"


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
        transfers_sha256: the moves around the search it was made for; empty if only the search was looked at.
    """

    checks: tuple[Check, ...]
    indicators: Indicators
    mission_sha256: str
    trajectories_sha256: tuple[tuple[str, str], ...]
    transfers_sha256: str = ""

    @property
    def passed(self) -> bool:
        """Whether something was checked and nothing failed; warnings do not count."""
        return bool(self.checks) and not self.failures

    @property
    def failures(self) -> tuple[Check, ...]:
        """Checks that void the certificate."""
        return tuple(check for check in self.checks if check.fails)

    @property
    def warnings(self) -> tuple[Check, ...]:
        """Advice that was not met."""
        return tuple(check for check in self.checks if not check.passed and not check.fails)
