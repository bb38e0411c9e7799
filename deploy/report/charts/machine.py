"""Charts of the drones themselves: attitude, motors, batteries."""

from __future__ import annotations

import math

import numpy as np

from deploy.analysis.record import FlightAnalysis
from deploy.analysis.telemetry import motor_share, tilt_angles
from deploy.report.charts.chart import Chart, curve, limit, lines, panel, per_robot
from deploy.report.playback import zero_time
from missions.airframes import airframe

_HEADROOM = 0.85  # of a motor's range that a good flight's strongest moment takes


def attitude(analysis: FlightAnalysis) -> Chart | None:
    """Roll, pitch and yaw by the drones' own estimates."""
    mission = analysis.flight_plan.mission
    names = [robot.name for robot in mission.robots]
    tilts = {name: tilt for name in names if len(tilt := tilt_angles(analysis.record, name)[1])}
    if not tilts:
        return None
    worst = max(tilts, key=lambda name: float(tilts[name].max()))
    most, allowed = math.degrees(float(tilts[worst].max())), math.degrees(mission.safety.tilt_limit)
    reading = f"most tilted: {worst}, by {most:.0f}°; the flight's limit is {allowed:.0f}°"
    limits = []
    if mission.flight.controller == "pid":
        steepest = math.degrees(airframe(mission.flight.airframe).tilt_limit)
        limits = [limit(steepest, f"PID's limit {steepest:.0f}°"), limit(-steepest, "")]
        reading += f", its controller's {steepest:.0f}°"
    reading += ": fly slower" if most > allowed / 2.0 else ", nothing to do"
    panels = []
    for axis, name in enumerate(("roll", "pitch", "yaw")):
        curves = per_robot(analysis, "estimate", lambda s, axis=axis: np.degrees(s["attitude"][:, axis]))  # type: ignore[misc]
        panels.append(panel(f"°, {name}", curves, limits if axis < 2 else (), zero=True))
    return lines("tracking", "attitude", "Attitude", reading, panels)


def motors(analysis: FlightAnalysis) -> Chart | None:
    """Mean command of each drone's motors, and that of the strongest: what is left of the thrust."""
    zero, mean, strongest = zero_time(analysis), [], []
    peaks: dict[str, float] = {}
    for i, robot in enumerate(analysis.flight_plan.mission.robots):
        t, share = motor_share(analysis.record, robot.name)
        if not len(t):
            continue
        mean.append(curve(robot.name, t - zero, 100.0 * share.mean(axis=1), robot=i))
        strongest.append(curve(robot.name, t - zero, 100.0 * share.max(axis=1), robot=i, keep="largest"))
        peaks[robot.name] = float(share.max())
    if not peaks:
        return None
    worst = max(peaks, key=lambda name: peaks[name])
    reading = f"hardest at work: {worst}, with a motor at {peaks[worst] * 100:.0f} % of its range"
    reading += (
        ": less weight, a fresh battery, or a lower limits.acceleration"
        if peaks[worst] > _HEADROOM
        else (", there is thrust in reserve")
    )
    full = [limit(100.0, "all it has")]
    panels = [
        panel("%, mean of four", mean, full, zero=True),
        panel("%, strongest of four", strongest, full, zero=True),
    ]
    return lines("tracking", "motors", "Thrust and saturation", reading, panels)


def battery(analysis: FlightAnalysis) -> Chart | None:
    """Voltages under load, and how long they would have lasted."""
    curves = list(per_robot(analysis, "battery", "voltage", keep="smallest"))
    if not curves:
        return None
    bound = analysis.flight_plan.mission.safety.battery_limit
    known = [item for item in analysis.batteries if not math.isnan(item.smallest)]
    worst = min(known, key=lambda item: item.smallest)
    reading = f"lowest: {worst.robot} with {worst.smallest:.2f} V, {worst.smallest - bound:.2f} V above the limit"
    lasting = [item for item in known if math.isfinite(item.left)]
    if lasting:
        first = min(lasting, key=lambda item: item.left)
        reading += f"; {first.robot}'s would be empty first, {_duration(first.left)} after the search"
        reading += (
            ": charge before the next flight"
            if first.left < analysis.flight_plan.mission.horizon.duration
            else (": enough for another one")
        )
    return lines(
        "machine", "battery", "Battery", reading, [panel("V, under load", curves, [limit(bound, f"limit {bound:g} V")])]
    )


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120.0 else f"{seconds / 60.0:.0f} min"
