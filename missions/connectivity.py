"""Connectivity policies: who has to be within communication range of whom, when, and how surely.

A policy is about *pairs* of robots (:class:`Pairs`) in *sub-periods* of the horizon (:class:`SubPeriods`). Two robots
are in contact at an instant when their distance is at most R_c, and connected over a sub-period in the sense of the
policy: by a connection probability, at given instants, for a length of time, or always.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from missions.fields import Vector, field


@dataclass(frozen=True, kw_only=True)
class PairThreshold:
    """Another threshold for one pair."""

    pair: tuple[str, ...] = field("names of the two robots", items=(2, 2))
    threshold: float = field("least connection probability of this pair", above=0.0, below=1.0)


@dataclass(frozen=True, kw_only=True)
class Pairs:
    """Which pairs a policy is about; never in a file by itself."""

    range: float = field("communication range R_c", unit="m", above=0.0)
    pairs: Literal["all", "ring", "chain", "star"] | tuple[tuple[str, ...], ...] = field(
        "which pairs must connect: all, ring or chain (neighbours in the order of the robots, the ring closed), star "
        "(everybody with the hub), or a list of pairs of names",
        default="all",
        items=(1, 4950),
    )
    hub: str = field("name of the robot in the middle of a star", default="")


@dataclass(frozen=True, kw_only=True)
class SubPeriods(Pairs):
    """Pairs, and the sub-periods in which they connect; never in a file by itself."""

    sub_periods: int = field("number of equal sub-periods N_p", at_least=1, default=1)
    boundaries: Vector = field(
        "instants that divide the horizon into sub-periods, instead of equal ones",
        unit="s",
        above=0.0,
        default=(),
        items=(0, 1000),
    )
    graph: Literal["every", "connected"] = field(
        "what has to hold in each sub-period: every one of the pairs connects, or enough of them for the graph of "
        "those that do to connect all robots",
        default="every",
    )


@dataclass(frozen=True, kw_only=True)
class ProbabilisticConnectivity(SubPeriods):
    """Connection probabilities reach a threshold in every sub-period (IMEC, Eq. 8 and 9d)."""

    threshold: float = field("least connection probability ε_c", above=0.0, below=1.0)
    thresholds: tuple[PairThreshold, ...] = field("pairs with a threshold of their own", default=(), items=(0, 4950))
    indicator: Literal["gaussian", "sigmoid"] = field("shape of the connection indicator Γ", default="gaussian")
    steepness: float = field("r_Γ: how fast Γ falls with the squared distance", above=0.0, at_most=1000.0, default=1.0)
    policy: Literal["probabilistic"] = "probabilistic"


@dataclass(frozen=True, kw_only=True)
class SimultaneousConnectivity(SubPeriods):
    """The same-time variant of the connection probability reaches a threshold in every sub-period (IMEC, Eq. 29)."""

    threshold: float = field("least same-time connection probability", above=0.0, below=1.0)
    thresholds: tuple[PairThreshold, ...] = field("pairs with a threshold of their own", default=(), items=(0, 4950))
    indicator: Literal["gaussian", "sigmoid"] = field("shape of the connection indicator Γ", default="gaussian")
    steepness: float = field("r_Γ: how fast Γ falls with the squared distance", above=0.0, at_most=1000.0, default=1.0)
    policy: Literal["simultaneous"] = "simultaneous"


@dataclass(frozen=True, kw_only=True)
class PeriodicConnectivity(SubPeriods):
    """Pairs are in contact at given instants (IMEC, Eq. 31a)."""

    instants: Vector = field(
        "when to be within range; default: at the end of every sub-period",
        unit="s",
        above=0.0,
        default=(),
        items=(0, 1000),
    )
    policy: Literal["periodic"] = "periodic"


@dataclass(frozen=True, kw_only=True)
class AllTimeConnectivity(Pairs):
    """Pairs are in contact all the time (IMEC baseline B1)."""

    graph: Literal["every", "connected"] = field(
        "what has to hold at every instant: every one of the pairs is in contact, or enough of them for the graph of "
        "those that are to connect all robots",
        default="every",
    )
    policy: Literal["all_time"] = "all_time"


@dataclass(frozen=True, kw_only=True)
class GuaranteedConnectivity(SubPeriods):
    """Pairs are truly in contact for at least a given time in every sub-period, proven on what will fly."""

    duration: float = field("least time in contact in every sub-period", unit="s", above=0.0, at_most=3600.0)
    contact: Literal["single", "total"] = field(
        "one contact of the duration, or contacts that sum up to it", default="single"
    )
    policy: Literal["guaranteed"] = "guaranteed"


@dataclass(frozen=True, kw_only=True)
class NoConnectivity:
    """Robots need not meet (IMEC baseline B2); meetings are still reported if a range is given."""

    range: float | None = field("communication range, for reporting only", unit="m", above=0.0, default=None)
    policy: Literal["none"] = "none"


Connectivity = (
    ProbabilisticConnectivity
    | SimultaneousConnectivity
    | PeriodicConnectivity
    | AllTimeConnectivity
    | GuaranteedConnectivity
    | NoConnectivity
)
