"""Charts of the motion: how close to each other and to obstacles, how well on the trajectory, how high."""

from __future__ import annotations

import math

import numpy as np

from deploy.analysis.record import FlightAnalysis
from deploy.analysis.separation import clearances, nearest
from deploy.analysis.timing import mean_lag
from deploy.analysis.tracking import Tracking
from deploy.analysis.verdict import CLEARANCE_ALLOWANCE, SEPARATION_ALLOWANCE, TRACKING_LIMIT
from deploy.report.charts.chart import Chart, Panel, curve, limit, lines, panel
from deploy.report.playback import zero_time
from missions.arrays import Array
from missions.fleet import altitudes

_PUNCTUAL = 0.02  # s of lag that is none: what separates two poses
_LATE = 0.06  # s that are worth something to be done


def separation(analysis: FlightAnalysis) -> Chart | None:
    """Smallest distance of any two, and to any obstacle, with what the mission asks for."""
    found, mission = analysis.separation, analysis.flight_plan.mission
    if found is None or (math.isnan(found.at) and not math.isfinite(found.clearance)):
        return None
    zero, asked = zero_time(analysis), mission.limits.separation
    planned_t, planned = _reference(analysis)
    flown = [curve("flown", found.t - zero, found.distance, keep="smallest")] if not math.isnan(found.at) else []
    between = [curve("certified", planned_t, nearest(mission, planned), style="certified", keep="smallest"), *flown]
    panels = [
        panel("m, between any two", between if flown else [], [limit(asked, f"asked for: {asked:g} m")], zero=True)
    ]
    readings = []
    if flown:
        allowed = asked - SEPARATION_ALLOWANCE
        readings.append(f"closest: {'–'.join(found.pair)} with {found.smallest:.3f} m at {found.at - zero:.1f} s")
        readings.append("raise limits.separation" if found.smallest < allowed else f"{allowed:.2f} m are allowed")
    if mission.obstacles and math.isfinite(found.clearance):
        panels.append(_clearance(analysis, planned_t, planned))
        near = "give obstacles a margin" if found.clearance < -CLEARANCE_ALLOWANCE else "which is fine"
        readings.append(f"obstacles were passed at {found.clearance * 100:.1f} cm at least, {near}")
    return lines("safety", "separation", "Separation and clearance", "; ".join(readings), panels)


def _clearance(analysis: FlightAnalysis, planned_t: Array, planned: Array) -> Panel:
    mission, window, motion = analysis.flight_plan.mission, analysis.window, analysis.motion
    curves = [curve("certified", planned_t, clearances(mission, planned), style="certified", keep="smallest")]
    if window is not None and motion is not None:
        t, q = motion.during(window)
        curves.append(curve("flown", t, clearances(mission, q), keep="smallest"))
    return panel("m, to any obstacle", curves, [limit(0.0, "obstacle")])


def _reference(analysis: FlightAnalysis) -> tuple[Array, Array]:
    """Mission times (S,) and where everybody should have been (S, N, 3)."""
    if not analysis.tracking:
        return np.empty(0), np.empty((0, len(analysis.flight_plan.mission.robots), 3))
    return analysis.tracking[0].t, np.stack([item.reference for item in analysis.tracking], axis=1)


def tracking(analysis: FlightAnalysis) -> Chart | None:
    """Distance to the certified trajectory, and the deviation along each axis."""
    known = [(i, item) for i, item in enumerate(analysis.tracking) if not math.isnan(item.mean)]
    if not known:
        return None
    allowed = limit(TRACKING_LIMIT * 100.0, f"mean allowed: {TRACKING_LIMIT * 100:.0f} cm")
    panels = [
        panel(
            "cm, distance",
            [curve(item.robot, item.t, item.error * 100.0, robot=i, keep="largest") for i, item in known],
            [allowed],
            zero=True,
        )
    ]
    for axis, name in enumerate("xyz"):
        curves = [curve(item.robot, item.t, item.deviation[:, axis] * 100.0, robot=i) for i, item in known]
        panels.append(panel(f"cm, along {name}", curves, zero=True))
    reading = _tracking_words(analysis, [item for _, item in known])
    return lines("tracking", "tracking", "Tracking error", reading, panels, wide=True)


def _tracking_words(analysis: FlightAnalysis, known: list[Tracking]) -> str:
    mean = sum(item.mean for item in known) / len(known)
    lag = mean_lag([item.mean_lag for item in known])
    said = f"{mean * 100:.1f} cm on average"
    if math.isnan(lag):
        return f"{said}; too little was flown to tell a lag"
    axes = ", ".join(
        f"{name} {value * 1000:.0f} ms"
        for axis, name in enumerate("xyz")
        if not math.isnan(value := mean_lag([item.lag[axis] for item in known]))
    )
    if abs(lag) < _PUNCTUAL:
        return f"{said}; mean lag {lag * 1000:.0f} ms ({axes}): in time, nothing to do"
    rest = sum(item.residual for item in known) / len(known)
    said += f"; mean lag {lag * 1000:.0f} ms ({axes}), without it {rest * 100:.1f} cm"
    if lag < _LATE:
        return f"{said}: as a good controller has"
    late = mean_lag([item.setpoint for item in analysis.timings])
    if not math.isnan(late) and late > lag / 2.0:
        return f"{said}: the setpoints came {late * 1000:.0f} ms late themselves: look at the radio's latency"
    if analysis.flight_plan.mission.flight.controller == "pid":
        return f"{said}: raise posCtlPid.xKp and yKp, or fly with controller: mellinger, which knows the speed"
    return f"{said}: raise ctrlMel.kp_xy and kd_xy, or fly slower"


def altitude(analysis: FlightAnalysis) -> Chart | None:
    """Height of everybody over the whole flight."""
    motion, mission = analysis.motion, analysis.flight_plan.mission
    if motion is None:
        return None
    zero, planned = zero_time(analysis), altitudes(mission)
    reading = "take-off, search and landing"
    if analysis.window is not None:
        z = motion.during(analysis.window)[1][:, :, 2]
        if mission.dimension == 2 and np.isfinite(z).any():
            spread = float(np.nanmax(np.abs(z - planned)))
            layers = ", ".join(f"{height:g}" for height in sorted(set(planned.tolist())))
            reading = f"planned {layers} m; nobody strayed more than {spread * 100:.1f} cm from it while searching"
            reading += ": look for downwash or weak batteries" if spread > TRACKING_LIMIT else ", nothing to do"
    curves = [curve(robot.name, motion.t - zero, motion.q[:, i, 2], robot=i) for i, robot in enumerate(mission.robots)]
    return lines("safety", "altitude", "Altitude", reading, [panel("m", curves, zero=True)])
