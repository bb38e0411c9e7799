"""One time axis: flight clock, mission time, and all robots' positions on one grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deploy.flightlog.reader import FlightRecord, Series
from missions.arrays import Array, frozen

GRID_RATE = 50.0  # Hz
GAP = 0.25  # s without a sample beyond which a position is not known


@dataclass(frozen=True)
class MissionWindow:
    """When the search was flown, on the flight clock [s].

    Attributes:
        start: when the trajectories started. end: when they ended, or when the flight or its log did.
        complete: whether the end was reached.
    """

    start: float
    end: float
    complete: bool


@dataclass(frozen=True)
class Motion:
    """Positions of all robots on one grid.

    Attributes:
        t: (S,) flight clock [s].
        q: (S, N, 3) positions [m], NaN where not known.
        source: ``pose`` (motion capture) or ``estimate`` (the drones' own word).
    """

    t: Array
    q: Array
    source: str

    def during(self, window: MissionWindow) -> tuple[Array, Array]:
        """Mission times and positions inside a window."""
        inside = (self.t >= window.start) & (self.t <= window.end)
        return self.t[inside] - window.start, self.q[inside]


def mission_window(record: FlightRecord, duration: float) -> MissionWindow | None:
    """The search's window from the events ``mission_start`` and ``mission_end``; None if it never began.

    Without an end (an abort, a cut log) the window ends with the phase after the search, or with the log, and never
    later than ``duration`` [s] after its start.
    """
    started = next((event for event in record.events if event.name == "mission_start"), None)
    if started is None:
        return None
    after = [event for event in record.events if event.t >= started.t]
    ended = next((event for event in after if event.name == "mission_end"), None)
    if ended is not None:
        return MissionWindow(started.t, min(ended.t, started.t + duration), complete=True)
    left = [event.t for event in after if event.name in {"abort", "emergency"}]
    last = left[:1] or [series.t[-1] for series in record.series.values() if len(series)]
    return MissionWindow(started.t, min(max(last), started.t + duration), complete=False)


def flown_motion(record: FlightRecord, robots: tuple[str, ...]) -> Motion | None:
    """Positions of these robots over the whole flight; None when nobody was ever located.

    Motion capture is preferred; without any the drones' own estimates are taken.
    """
    for source in ("pose", "estimate"):
        series = [record.of(robot, source) for robot in robots]
        known = [item for item in series if item is not None and len(item) > 1]
        if known:
            begin, end = min(item.t[0] for item in known), max(item.t[-1] for item in known)
            t = np.arange(np.ceil(begin * GRID_RATE), np.floor(end * GRID_RATE) + 1) / GRID_RATE
            q = np.stack([sample(item, "position", t) for item in series], axis=1)
            return Motion(frozen(t), frozen(q), source)
    return None


def sample(series: Series | None, field: str, t: Array) -> Array:
    """A vector field (len(t), 3) at times t, linear between samples; NaN where no sample is near enough."""
    if series is None or len(series) < 2:
        return np.full((len(t), 3), np.nan)
    values = series[field]
    known = np.isfinite(values).all(axis=1)
    at, values = series.t[known], values[known]
    if len(at) < 2:
        return np.full((len(t), 3), np.nan)
    out = np.stack([np.interp(t, at, values[:, axis]) for axis in range(3)], axis=1)
    later = np.clip(np.searchsorted(at, t), 1, len(at) - 1)
    hole = (at[later] - at[later - 1] > GAP) & (t > at[later - 1]) & (t < at[later])
    out[hole | (t < at[0] - GAP) | (t > at[-1] + GAP)] = np.nan
    return out
