"""Charts of what comes through the air: the radio, and motion capture."""

from __future__ import annotations

import math

import numpy as np

from deploy.analysis.record import FlightAnalysis
from deploy.flightlog.reader import Series
from deploy.report.charts.chart import Chart, Curve, curve, lines, panel, per_robot
from deploy.report.playback import zero_time
from missions.arrays import Array

_SLOW, _LOSSY = 50.0, 97.0  # ms, %: as the diagnoses have them
_UNSTEADY = 0.25  # of the usual time between two poses that it may vary by
_WINDOW = 1.0  # s over which rates are counted


def radio(analysis: FlightAnalysis) -> Chart | None:
    """Latency, acknowledged share, signal strength and packets of each link."""
    panels = [
        panel("ms, round trip", per_robot(analysis, "link", "latency_ms", keep="largest"), zero=True),
        panel("%, acknowledged", per_robot(analysis, "link", "quality", keep="smallest")),
        panel("-dBm, signal", per_robot(analysis, "link", "rssi")),
        panel("1/s, packets sent and received", per_robot(analysis, "link", _packets), zero=True),
    ]
    known = [item for item in analysis.links if not math.isnan(item.latency_p95)]
    if not any(item["curves"] for item in panels) or not known:
        return None
    slowest = max(known, key=lambda item: item.latency_p95)
    worst = min(known, key=lambda item: item.quality_smallest if math.isfinite(item.quality_smallest) else math.inf)
    lost = sum(item.lost for item in analysis.links)
    reading = f"slowest: {slowest.robot}, 95 % of answers within {slowest.latency_p95:.0f} ms"
    if math.isfinite(worst.quality_smallest):
        reading += f"; worst: {worst.robot}, {worst.quality_smallest:.1f} % acknowledged"
    reading += f"; {lost} requests lost: " if lost else "; no request lost: "
    if slowest.latency_p95 > _SLOW:
        reading += "fewer drones a dongle, or lower rates"
    elif lost or worst.quality_smallest < _LOSSY:
        reading += "another channel, or the dongle closer"
    else:
        reading += "nothing to do"
    return lines("machine", "link", "Radio", reading, panels)


def _packets(series: Series) -> Array:
    """Packets a second between two reports; NaN at the first."""
    count = series["sent"] + series["received"]
    rate = np.full(len(count), np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        rate[1:] = np.diff(count) / np.diff(series.t)
    return rate


def mocap(analysis: FlightAnalysis) -> Chart | None:
    """How often and how regularly each robot was seen, and how late its poses could be used."""
    rates, gaps = [], []
    for i, robot in enumerate(analysis.flight_plan.mission.robots):
        series = analysis.record.of(robot.name, "pose")
        if series is None or len(series) < 2:
            continue
        rates.append(_rate(analysis, robot.name, i, series.t))
        between = 1000.0 * np.diff(series.t)
        gaps.append(curve(robot.name, series.t[1:] - zero_time(analysis), between, robot=i, keep="largest"))
    if not rates:
        return None
    panels = [
        panel("Hz, poses", rates, zero=True),
        panel("ms, between poses", gaps, zero=True),
        panel("ms, latency", _latency(analysis), zero=True),
    ]
    seen = [item for item in analysis.feeds if item.rate > 0.0]
    gap = max(seen, key=lambda item: item.longest_gap)
    jitter = max(item.jitter for item in seen if math.isfinite(item.jitter))
    steady = jitter * min(item.rate for item in seen)
    reading = f"{np.median([item.rate for item in seen]):.0f} Hz; longest gap {gap.longest_gap:.2f} s ({gap.robot}, "
    reading += f"{gap.gap_at - zero_time(analysis):.1f} s); jitter {jitter * 1000:.1f} ms"
    reading += ": look for other programs on its network" if steady > _UNSTEADY else ", steady"
    return lines("machine", "mocap", "Motion capture", reading, panels)


def _rate(analysis: FlightAnalysis, name: str, robot: int, t: Array) -> Curve:
    """Poses a second, counted over the second before."""
    at = np.arange(t[0] + _WINDOW, t[-1], _WINDOW / 2.0)
    count = np.searchsorted(t, at) - np.searchsorted(t, at - _WINDOW)
    return curve(name, at - zero_time(analysis), count / _WINDOW, robot=robot, keep="smallest")


def _latency(analysis: FlightAnalysis) -> list[Curve]:
    series = analysis.record.series.get("/mocap")
    if series is None or not np.isfinite(series["latency_ms"]).any():
        return []
    t = series.t - zero_time(analysis)
    return [
        curve("mean", t, series["latency_ms"], keep="largest"),
        curve("longest", t, series["worst_latency_ms"], style="certified", keep="largest"),
    ]
