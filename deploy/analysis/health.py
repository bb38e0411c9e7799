"""Battery, radio link and motion capture over the flight."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from deploy.flightlog.reader import FlightRecord, Series
from missions.arrays import Array


@dataclass(frozen=True)
class BatteryUse:
    """One robot's battery [V]; NaN without data. ``low``: whether the firmware called it low."""

    robot: str
    start: float
    smallest: float
    end: float
    low: bool


@dataclass(frozen=True)
class LinkUse:
    """One robot's link over the flight; NaN without data.

    Attributes:
        latency_median, latency_p95: round trip [ms]. quality_smallest: [%]. lost: packets known to be lost.
        reports: how many statistics were logged.
    """

    robot: str
    latency_median: float
    latency_p95: float
    quality_smallest: float
    lost: int
    reports: int


@dataclass(frozen=True)
class PoseFeed:
    """How steadily a robot was seen: rate [Hz], longest gap [s] and when it began (flight clock) [s]."""

    robot: str
    rate: float
    longest_gap: float
    gap_at: float


def battery_use(record: FlightRecord, robot: str) -> BatteryUse:
    """A robot's battery."""
    series = record.of(robot, "battery")
    voltage = _known(series, "voltage")
    if series is None or not len(voltage):
        return BatteryUse(robot, math.nan, math.nan, math.nan, False)
    low = bool((series["state"] >= 3).any())
    return BatteryUse(robot, float(voltage[0]), float(voltage.min()), float(voltage[-1]), low)


def link_use(record: FlightRecord, robot: str) -> LinkUse:
    """A robot's link."""
    series = record.of(robot, "link")
    latency, quality, lost = (_known(series, field) for field in ("latency_ms", "quality", "lost"))
    return LinkUse(
        robot=robot,
        latency_median=float(np.median(latency)) if len(latency) else math.nan,
        latency_p95=float(np.percentile(latency, 95)) if len(latency) else math.nan,
        quality_smallest=float(quality.min()) if len(quality) else math.nan,
        lost=int(lost.max()) if len(lost) else 0,
        reports=0 if series is None else len(series),
    )


def pose_feed(record: FlightRecord, robot: str) -> PoseFeed:
    """How steadily a robot was seen by motion capture."""
    series = record.of(robot, "pose")
    if series is None or len(series) < 2:
        return PoseFeed(robot, 0.0, math.nan, math.nan)
    steps = np.diff(series.t)
    worst = int(steps.argmax())
    return PoseFeed(robot, float(1.0 / np.median(steps)), float(steps[worst]), float(series.t[worst]))


def _known(series: Series | None, field: str) -> Array:
    if series is None:
        return np.empty(0)
    values = series[field]
    return values[np.isfinite(values)]
