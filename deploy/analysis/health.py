"""Battery, radio link and motion capture over the flight."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from deploy.analysis.align import MissionWindow
from deploy.flightlog.reader import FlightRecord, Series
from missions.arrays import Array

_LOW_POWER = 3  # pm.h: low power, 4 is shut down
_FIRST = 10  # samples that a voltage is read from
_GAP = 4.0  # poses this many periods apart are a gap, and no jitter
_AIRBORNE = frozenset({"taking off", "airborne", "transferring"})


@dataclass(frozen=True)
class BatteryUse:
    """One robot's battery; NaN without data.

    Attributes:
        start, smallest, end: of the voltage [V].
        low: whether the firmware called it low.
        sag: how far the voltage falls when the motors start [V].
        slope: of the voltage in the search [V/s], negative while it empties.
        left: how long the search could have gone on, at that slope, until the mission's limit
            [s]; inf if it did not fall.
    """

    robot: str
    start: float
    smallest: float
    end: float
    low: bool
    sag: float = math.nan
    slope: float = math.nan
    left: float = math.nan


@dataclass(frozen=True)
class LinkUse:
    """One robot's link over the flight; NaN without data.

    Attributes:
        latency_median, latency_p95, latency_largest: round trip [ms].
        quality_median, quality_smallest: share of attempts that were acknowledged [%].
        rssi: median signal strength [dBm], as the dongle counts it.
        rate: packets sent and received [1/s].
        lost: requests known to be lost. reports: how many statistics were logged.
    """

    robot: str
    latency_median: float
    latency_p95: float
    latency_largest: float
    quality_median: float
    quality_smallest: float
    rssi: float
    rate: float
    lost: int
    reports: int


@dataclass(frozen=True)
class PoseFeed:
    """How steadily a robot was seen.

    Attributes:
        rate: [Hz]. jitter: standard deviation of the time from one pose to the next, gaps apart [s].
        longest_gap: [s]. gap_at: when it began (flight clock) [s].
    """

    robot: str
    rate: float
    longest_gap: float
    gap_at: float
    jitter: float = math.nan


def battery_use(record: FlightRecord, robot: str, window: MissionWindow | None, limit: float) -> BatteryUse:
    """A robot's battery; ``limit`` is the voltage [V] at which a flight has to end."""
    series = record.of(robot, "battery")
    voltage = _known(series, "voltage")
    if series is None or not len(voltage):
        return BatteryUse(robot, math.nan, math.nan, math.nan, False)
    sag, slope = math.nan, math.nan
    t = series.t[np.isfinite(series["voltage"])]
    if window is not None:
        loaded = (t >= window.start) & (t <= window.end)
        rest = voltage[t < _take_off(record, window.start)]
        if loaded.any() and len(rest):
            sag = float(np.median(rest) - np.median(voltage[loaded][:_FIRST]))
        if loaded.sum() >= _FIRST:
            slope = float(np.polyfit(t[loaded] - window.start, voltage[loaded], 1)[0])
            last = float(np.median(voltage[loaded][-_FIRST:]))
            left = (last - limit) / -slope if slope < 0.0 else math.inf
            return _battery(series, robot, voltage, sag, slope, max(0.0, left))
    return _battery(series, robot, voltage, sag, slope, math.nan)


def _battery(series: Series, robot: str, voltage: Array, sag: float, slope: float, left: float) -> BatteryUse:
    low = bool((series["state"] >= _LOW_POWER).any())
    return BatteryUse(
        robot, float(voltage[0]), float(voltage.min()), float(voltage[-1]), low, sag=sag, slope=slope, left=left
    )


def _take_off(record: FlightRecord, latest: float) -> float:
    """When the motors started [s]: the first phase that speaks of it."""
    return min((event.t for event in record.events if event.phase in _AIRBORNE), default=latest)


def link_use(record: FlightRecord, robot: str) -> LinkUse:
    """A robot's link."""
    series = record.of(robot, "link")
    latency, quality, rssi, lost = (_known(series, field) for field in ("latency_ms", "quality", "rssi", "lost"))
    rate = math.nan
    if series is not None and len(series) > 1 and series.t[-1] > series.t[0]:
        packets = series["sent"] + series["received"]
        rate = float((packets[-1] - packets[0]) / (series.t[-1] - series.t[0]))
    return LinkUse(
        robot=robot,
        latency_median=_median(latency),
        latency_p95=float(np.percentile(latency, 95)) if len(latency) else math.nan,
        latency_largest=float(latency.max()) if len(latency) else math.nan,
        quality_median=_median(quality),
        quality_smallest=float(quality.min()) if len(quality) else math.nan,
        rssi=_median(rssi),
        rate=rate,
        lost=int(lost.max()) if len(lost) else 0,
        reports=0 if series is None else len(series),
    )


def pose_feed(record: FlightRecord, robot: str) -> PoseFeed:
    """How steadily a robot was seen by motion capture."""
    series = record.of(robot, "pose")
    if series is None or len(series) < 2:
        return PoseFeed(robot, 0.0, math.nan, math.nan)
    steps = np.diff(series.t)
    worst, usual = int(steps.argmax()), float(np.median(steps))
    regular = steps[steps < _GAP * usual]
    jitter = float(regular.std()) if len(regular) else math.nan
    return PoseFeed(robot, 1.0 / usual if usual else 0.0, float(steps[worst]), float(series.t[worst]), jitter)


def _median(values: Array) -> float:
    return float(np.median(values)) if len(values) else math.nan


def _known(series: Series | None, field: str) -> Array:
    if series is None:
        return np.empty(0)
    values = series[field]
    return values[np.isfinite(values)]
