"""The page's charts: title, unit, a one-line reading, curves and limits; drawn by ``charts.js``."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from deploy.analysis.record import FlightAnalysis
from deploy.analysis.verdict import SEPARATION_ALLOWANCE, TRACKING_LIMIT
from deploy.report.packing import floats, thin
from deploy.report.playback import zero_time
from deploy.report.words import scientific
from missions.arrays import Array
from missions.fleet import altitudes

POINTS = 1200  # of a curve
_PUNCTUAL = 0.01  # s of lag that is none: half of what separates two poses
Chart = dict[str, object]
Curve = dict[str, object]


def all_charts(analysis: FlightAnalysis) -> list[Chart]:
    """Every chart there is data for, in the order of the page."""
    charts = (
        _ergodicity(analysis),
        _separation(analysis),
        _meetings(analysis),
        _tracking(analysis),
        _altitude(analysis),
        _battery(analysis),
        _link(analysis),
    )
    return [chart for chart in charts if chart is not None]


def _curve(
    name: str, t: Array, y: Array, *, robot: int | None = None, style: str = "flown", keep: str = "every"
) -> Curve:
    t, y = thin(np.asarray(t), np.asarray(y), POINTS, keep)
    return {"name": name, "robot": robot, "style": style, "t": floats(t), "y": floats(y), "n": len(t)}


def _ergodicity(analysis: FlightAnalysis) -> Chart:
    found = analysis.coverage
    curves = [_curve("flown", found.t, found.flown_over_time)] if np.isfinite(found.flown_over_time).any() else []
    curves.append(_curve("certified", found.t, found.certified_over_time, style="planned"))
    planned, certified = found.planned.ergodicity, found.certified.ergodicity
    reading = f"E falls as the swarm covers the map: {scientific(certified)} certified (plan {scientific(planned)})"
    if found.flown is None:
        reading += "; the flight shows too little of the search to say"
    else:
        change = found.flown.ergodicity / certified - 1.0 if certified > 0.0 else 0.0
        more = f"{abs(change) * 100:.0f} % {'more' if change > 0 else 'less'}"
        reading += f", {scientific(found.flown.ergodicity)} flown, {more}."
    return {
        "id": "ergodicity",
        "title": "Ergodicity so far",
        "unit": "E, log scale",
        "reading": reading,
        "kind": "lines",
        "log": True,
        "curves": curves,
        "limits": [],
    }


def _meetings(analysis: FlightAnalysis) -> Chart | None:
    if not analysis.meetings:
        return None
    mission = analysis.flight_plan.mission
    reach = mission.connectivity.range
    flown = sum(bool(pair.flown) for pair in analysis.meetings)
    return {
        "id": "connectivity",
        "title": "Who was in range of whom",
        "unit": f"within {reach:g} m" if reach else "",
        "reading": f"{flown} of {len(analysis.meetings)} pairs came within {reach:g} m in flight; "
        "the outline is the plan, the bar the flight, vertical lines are sub-periods.",
        "kind": "spans",
        "rows": [
            {"name": "–".join(pair.robots), "planned": pair.certified, "flown": pair.flown}
            for pair in analysis.meetings
        ],
        "periods": _period_edges(analysis),
    }


def _period_edges(analysis: FlightAnalysis) -> list[float]:
    mission = analysis.flight_plan.mission
    periods = getattr(mission.connectivity, "sub_periods", 1)
    return [mission.horizon.duration * p / periods for p in range(periods + 1)]


def _separation(analysis: FlightAnalysis) -> Chart | None:
    found = analysis.separation
    if found is None or math.isnan(found.at):
        return None
    zero = zero_time(analysis)
    limit = analysis.flight_plan.mission.limits.separation
    return {
        "id": "separation",
        "title": "Smallest separation",
        "unit": "m, between any two robots",
        "reading": f"Closest: {'–'.join(found.pair)} at {found.at - zero:.1f} s with {found.smallest:.3f} m; "
        f"the mission asks for {limit:g} m, the verdict allows {limit - SEPARATION_ALLOWANCE:.2f} m.",
        "kind": "lines",
        "zero": True,
        "curves": [_curve("smallest", found.t - zero, found.distance, keep="smallest")],
        "limits": [{"y": limit, "name": f"separation {limit:g} m"}],
    }


def _tracking(analysis: FlightAnalysis) -> Chart | None:
    known = [(i, item) for i, item in enumerate(analysis.tracking) if not math.isnan(item.mean)]
    if not known:
        return None
    mean = sum(item.mean for _, item in known) / len(known)
    lags = [item.mean_lag for _, item in known if not math.isnan(item.mean_lag)]
    reading = f"{mean * 100:.1f} cm on average"
    if lags:
        rest = sum(item.residual for _, item in known) / len(known)
        reading += "; " + _lag_words(sum(lags) / len(lags), rest)
    return {
        "id": "tracking",
        "title": "Tracking error",
        "unit": "cm, distance to the certified trajectory",
        "reading": reading + ".",
        "kind": "lines",
        "zero": True,
        "curves": [_curve(item.robot, item.t, item.error * 100.0, robot=i, keep="largest") for i, item in known],
        "limits": [{"y": TRACKING_LIMIT * 100.0, "name": f"mean allowed: {TRACKING_LIMIT * 100:.0f} cm"}],
    }


def _lag_words(lag: float, rest: float) -> str:
    if abs(lag) < _PUNCTUAL:
        return f"the robots keep time with their trajectories to {_PUNCTUAL * 1000:.0f} ms"
    where = "behind" if lag > 0 else "ahead of"
    return f"the robots fly {abs(lag) * 1000:.0f} ms {where} their trajectories, without that {rest * 100:.1f} cm"


def _altitude(analysis: FlightAnalysis) -> Chart | None:
    motion = analysis.motion
    if motion is None:
        return None
    zero, planned = zero_time(analysis), altitudes(analysis.flight_plan.mission)
    window = analysis.window
    reading = "Take-off, search and landing"
    if window is not None:
        z = motion.during(window)[1][:, :, 2]
        if analysis.flight_plan.mission.dimension == 2 and np.isfinite(z).any():
            spread = float(np.nanmax(np.abs(z - planned)))
            layers = ", ".join(f"{height:g}" for height in sorted(set(planned.tolist())))
            reading = f"Planned {layers} m; nobody strayed more than {spread * 100:.1f} cm from it while searching"
    names = [robot.name for robot in analysis.flight_plan.mission.robots]
    return {
        "id": "altitude",
        "title": "Altitude",
        "unit": "m",
        "reading": reading + ".",
        "kind": "lines",
        "zero": True,
        "curves": [_curve(name, motion.t - zero, motion.q[:, i, 2], robot=i) for i, name in enumerate(names)],
        "limits": [],
    }


def _battery(analysis: FlightAnalysis) -> Chart | None:
    curves = list(_telemetry(analysis, "battery", "voltage", "smallest"))
    if not curves:
        return None
    known = [item for item in analysis.batteries if not math.isnan(item.smallest)]
    worst = min(known, key=lambda item: item.smallest)
    return {
        "id": "battery",
        "title": "Battery",
        "unit": "V, under load",
        "reading": f"Lowest: {worst.robot} with {worst.smallest:.2f} V; it began with {worst.start:.2f} V.",
        "kind": "lines",
        "curves": curves,
        "limits": [],
    }


def _link(analysis: FlightAnalysis) -> Chart | None:
    curves = list(_telemetry(analysis, "link", "latency_ms", "largest"))
    if not curves:
        return None
    known = [item for item in analysis.links if not math.isnan(item.latency_p95)]
    worst = max(known, key=lambda item: item.latency_p95)
    lost = sum(item.lost for item in analysis.links)
    said = f"{lost} packets lost" if lost else "no packet reported lost"
    reading = f"Slowest: {worst.robot}, 95 % within {worst.latency_p95:.1f} ms; {said}."
    if analysis.simulated and worst.latency_p95 == 0.0:
        reading = f"Ideal: the simulated radio answers at once; {said}."
    return {
        "id": "link",
        "title": "Radio latency",
        "unit": "ms, round trip",
        "reading": reading,
        "kind": "lines",
        "zero": True,
        "curves": curves,
        "limits": [],
    }


def _telemetry(analysis: FlightAnalysis, topic: str, field: str, keep: str) -> Iterable[Curve]:
    zero = zero_time(analysis)
    for i, robot in enumerate(analysis.flight_plan.mission.robots):
        series = analysis.record.of(robot.name, topic)
        if series is not None and np.isfinite(series[field]).any():
            yield _curve(robot.name, series.t - zero, series[field], robot=i, keep=keep)
