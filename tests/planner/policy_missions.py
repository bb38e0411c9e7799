"""Small missions, one for each connectivity policy and way to choose pairs, built from the records (no files)."""

from __future__ import annotations

from missions.connectivity import (
    AllTimeConnectivity,
    Connectivity,
    GuaranteedConnectivity,
    PairThreshold,
    PeriodicConnectivity,
    ProbabilisticConnectivity,
    SimultaneousConnectivity,
)
from missions.schema import Mission
from tests.planner.problems import robots, small

STARTS = ((-0.6, -0.7), (0.0, -0.7), (0.6, -0.7), (0.6, 0.0))

POLICIES: dict[str, Connectivity] = {
    "probabilistic, sigmoid": ProbabilisticConnectivity(
        range=0.5, threshold=0.2, indicator="sigmoid", steepness=3.0, sub_periods=2
    ),
    "probabilistic, ring, own thresholds": ProbabilisticConnectivity(
        range=0.5, threshold=0.2, thresholds=(PairThreshold(pair=("r3", "r0"), threshold=0.3),), pairs="ring"
    ),
    "probabilistic, connected": ProbabilisticConnectivity(
        range=0.5, threshold=0.2, steepness=2.0, graph="connected", boundaries=(3.0,)
    ),
    "simultaneous": SimultaneousConnectivity(range=0.5, threshold=0.3, pairs="star", hub="r1", boundaries=(3.0,)),
    "simultaneous, sigmoid, connected": SimultaneousConnectivity(
        range=0.5, threshold=0.3, indicator="sigmoid", steepness=5.0, graph="connected", sub_periods=2
    ),
    "periodic": PeriodicConnectivity(range=0.5, sub_periods=2, pairs=(("r0", "r1"), ("r3", "r1"))),
    "periodic, connected": PeriodicConnectivity(range=0.5, instants=(2.5, 8.0), graph="connected"),
    "all time": AllTimeConnectivity(range=0.7, pairs="chain"),
    "all time, connected": AllTimeConnectivity(range=0.7, graph="connected"),
    "guaranteed": GuaranteedConnectivity(range=0.5, duration=1.0, pairs="chain", boundaries=(3.0,)),
    "guaranteed, total": GuaranteedConnectivity(range=0.5, duration=1.0, contact="total", boundaries=(3.0,)),
    "guaranteed, connected": GuaranteedConnectivity(range=0.5, duration=0.5, graph="connected", sub_periods=2),
}


def with_policy(name: str) -> Mission:
    """Four drones, 8 s, under the policy."""
    return small(POLICIES[name], name="policy", robots=robots(*STARTS))
