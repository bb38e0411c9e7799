"""How late everything was by the certified trajectory: what was asked for, what was flown, what drones believed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from deploy.analysis.align import MissionWindow
from deploy.analysis.tracking import lags
from deploy.flightlog.reader import FlightRecord
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.trajectory.timeline import Timeline

_LEAST = 20  # samples a lag is estimated from


@dataclass(frozen=True)
class Timing:
    """How far one robot's records lag behind its certified trajectory [s]; NaN if they do not say.

    Attributes:
        setpoint: what its commander asked of its controller, as telemetry told: late starts, and late telemetry.
        estimate: where it believed to be, by the same telemetry.
        pose: where motion capture saw it.
    """

    robot: str
    setpoint: float
    estimate: float
    pose: float


def timing(
    record: FlightRecord, robot: str, window: MissionWindow, reference: PiecewisePolynomial, timeline: Timeline
) -> Timing:
    """Lags by cross-correlation, mean over the axes that moved."""
    found = []
    for topic in ("setpoint", "estimate", "pose"):
        series = record.of(robot, topic)
        lag = math.nan
        if series is not None:
            q = series["position"]
            use = (series.t >= window.start) & (series.t <= window.end) & np.isfinite(q).all(axis=1)
            if use.sum() >= _LEAST:
                lag = mean_lag(lags(timeline.at_each(series.t[use]), q[use], reference))
        found.append(lag)
    return Timing(robot, *found)


def mean_lag(lag: Sequence[float]) -> float:
    """Mean over the axes that say something [s]; NaN if none does."""
    known = [value for value in lag if not math.isnan(value)]
    return sum(known) / len(known) if known else math.nan
