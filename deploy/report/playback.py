"""What the page's 3-D playback needs: scene, flown and planned positions on one grid, phases, meetings' range."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from deploy.analysis.align import sample
from deploy.analysis.record import FlightAnalysis
from deploy.analysis.switches import timelines
from deploy.heat import heat_image
from deploy.report.packing import packed
from deploy.report.thing import seen_data, thing_data
from missions.arrays import Array
from missions.fleet import altitudes
from missions.obstacles import ObjectPart
from missions.schema import Mission, Obstacle
from missions.shapes import heights, outline
from planner.trajectory.encode import decode

_RATE = 20.0  # Hz
_GROUND = 0.05  # m; what asks for less asks for nothing
_MOST_SAMPLES = 150_000  # positions of one kind; longer flights are played with coarser steps


def zero_time(analysis: FlightAnalysis) -> float:
    """Flight clock [s] at the page's t = 0: the start of the search, or of the log if there was no search."""
    if analysis.window is not None:
        return analysis.window.start
    return float(analysis.motion.t[0]) if analysis.motion is not None else 0.0


def playback_data(analysis: FlightAnalysis) -> dict[str, object]:
    """Scene and motion; times are mission times [s], positions metres in the world frame."""
    t = _grid(analysis, len(analysis.flight_plan.mission.robots))
    return {
        **stage_data(analysis.flight_plan.mission),
        "t0": float(t[0]),
        "dt": float(t[1] - t[0]),
        "n": len(t),
        "thing": seen_data(analysis),
        "flown": packed(flown_positions(analysis, t)),
        "planned": packed(_planned(analysis, t)),
        "phases": phases(analysis),
        "marks": marks(analysis),
        "searched": _searched(analysis),
        "look": _look(analysis),
        "lights": _lights(analysis),
    }


def stage_data(mission: Mission) -> dict[str, object]:
    """What stands still: who flies, where, around what, over which map."""
    lower, upper = list(mission.workspace.lower), list(mission.workspace.upper)
    altitude = float(altitudes(mission).max())
    return {
        "robots": [robot.name for robot in mission.robots],
        "lower": [*lower[:2], lower[2] if len(lower) == 3 else 0.0],
        "upper": [*upper[:2], upper[2] if len(upper) == 3 else altitude],
        "range": mission.connectivity.range,
        "sees": [dataclasses.asdict(footprint) for footprint in mission.footprints],
        "altitude": altitude,
        "obstacles": [_obstacle(item) for item in mission.obstacles if not isinstance(item, ObjectPart)],
        "thing": thing_data(mission),
        "heat": heat_image(mission),
        "duration": mission.horizon.duration,
    }


def _obstacle(obstacle: Obstacle) -> dict[str, object]:
    """A prism to draw: outline seen from above [m], base and top [m]; no top reaches the ceiling."""
    low, high = heights(obstacle)
    ring = [[round(float(x), 4), round(float(y), 4)] for x, y in outline(obstacle)]
    return {"ring": ring, "low": low, "high": high if math.isfinite(high) else None}


def _lights(analysis: FlightAnalysis) -> list[list[list[float]]]:
    """Per robot what its LED ring was told: mission time [s], red, green, blue; none where it has no ring."""
    zero, out = zero_time(analysis), []
    for robot in analysis.flight_plan.mission.robots:
        told = analysis.record.of(robot.name, "light")
        rows = [] if told is None else zip(told.t, told["red"], told["green"], told["blue"], strict=True)
        out.append([[round(float(t) - zero, 3), *(int(part) for part in colour)] for t, *colour in rows])
    return out


def _searched(analysis: FlightAnalysis) -> float:
    """For how long the search was flown [s]."""
    return analysis.window.end - analysis.window.start if analysis.window is not None else 0.0


def _look(analysis: FlightAnalysis) -> float:
    """The moment [s] at which the page opens: of the first diagnosis that has one, else the end of the search."""
    known = (item.t for item in analysis.verdict.diagnoses if item.t is not None)
    first = next(known, None)
    return _searched(analysis) if first is None else first - zero_time(analysis)


def phases(analysis: FlightAnalysis) -> list[dict[str, object]]:
    """Phases of the flight with their begin and end in mission time [s]."""
    zero, last = zero_time(analysis), ""
    spans: list[dict[str, object]] = []
    end = max((float(series.t[-1]) for series in analysis.record.series.values() if len(series)), default=zero)
    for event in analysis.record.events:
        if event.phase and event.phase != last:
            if spans:
                spans[-1]["end"] = event.t - zero
            spans.append({"name": event.phase.replace("_", " "), "begin": event.t - zero, "end": end - zero})
            last = event.phase
    return spans


def marks(analysis: FlightAnalysis) -> list[dict[str, object]]:
    """Warnings and faults of the flight, at their mission times [s]."""
    zero = zero_time(analysis)
    return [
        {"t": event.t - zero, "level": event.level}
        for event in analysis.record.events
        if event.level != "info" and event.name != "preflight"
    ]


def _grid(analysis: FlightAnalysis, robots: int) -> Array:
    zero = zero_time(analysis)
    if analysis.motion is None:
        begin, end = 0.0, analysis.flight_plan.mission.horizon.duration
    else:
        begin, end = float(analysis.motion.t[0]) - zero, float(analysis.motion.t[-1]) - zero
    step = max(1.0 / _RATE, (end - begin) * robots / _MOST_SAMPLES)
    return begin + step * np.arange(max(2, int((end - begin) / step) + 1), dtype=np.float64)


def flown_positions(analysis: FlightAnalysis, t: Array) -> Array:
    """(S, N, 3), the nearest sample in time, NaN where nobody saw the robot."""
    motion = analysis.motion
    if motion is None:
        return np.full((len(t), len(analysis.flight_plan.mission.robots), 3), np.nan)
    at = t + zero_time(analysis)
    nearest = np.clip(np.searchsorted(motion.t, at - 1e-9), 0, len(motion.t) - 1)
    outside = (at < motion.t[0] - 1.0 / _RATE) | (at > motion.t[-1] + 1.0 / _RATE)
    return np.where(outside[:, None, None], np.nan, motion.q[nearest])


def _planned(analysis: FlightAnalysis, t: Array) -> Array:
    """(S, N, 3) of the certified trajectories in the search, of the setpoints around it."""
    plan = analysis.flight_plan
    references = [decode(plan.trajectories[robot.name]) for robot in plan.mission.robots]
    zero, window = zero_time(analysis), analysis.window
    courses = timelines(analysis.record, plan, window) if window is not None else {}
    moments = [courses[robot.name].at_each(zero + t) if courses else t for robot in plan.mission.robots]
    q = np.stack([reference.evaluate(s)[:, :3] for reference, s in zip(references, moments, strict=True)], axis=1)
    around = (t < 0.0) | (t > max(reference.duration for reference in references))
    q[around] = _asked_for(analysis, t[around])
    return q


def _asked_for(analysis: FlightAnalysis, t: Array) -> Array:
    """(S, N, 3) of the drones' own setpoints, on the way to the search and back; NaN on the ground."""
    record, zero = analysis.record, zero_time(analysis)
    names = [robot.name for robot in analysis.flight_plan.mission.robots]
    q = np.stack([sample(record.of(name, "setpoint"), "position", zero + t) for name in names], axis=1)
    q[~(q[:, :, 2] > _GROUND)] = np.nan
    return q
