"""What the drones saw of the object they flew around, from where they were and as they looked."""

from __future__ import annotations

import numpy as np

from deploy.analysis.align import GAP
from deploy.analysis.evidence import Evidence
from deploy.flightlog.reader import Series
from missions.arrays import Array
from planner.surface.seen import SeenSurface, seen_surface
from planner.trajectory.encode import decode


def flown_sights(evidence: Evidence) -> SeenSurface | None:
    """At every planning step of the search; None without an object or a search.

    Headings are the drones' own estimates; where those are not known, nothing counts as seen.
    """
    mission, window, motion = evidence.mission, evidence.window, evidence.motion
    if mission.object is None or window is None or motion is None:
        return None
    t = np.arange(mission.steps, dtype=np.float64) * mission.horizon.dt
    t = t[t <= window.end - window.start]
    at, q = motion.during(window)
    places = np.stack([_nearest(t, at, q[:, robot]) for robot in range(q.shape[1])], axis=1)
    told = (evidence.record.of(name, "estimate") for name in evidence.names)
    heading = np.stack([_heading(estimate, window.start + t) for estimate in told], axis=1)
    places[~np.isfinite(heading)] = np.nan
    return seen_surface(mission, places, heading)


def certified_sights(evidence: Evidence) -> SeenSurface | None:
    """Of the bytes that were uploaded, headings included; None without an object."""
    mission = evidence.mission
    if mission.object is None:
        return None
    t = np.arange(mission.steps, dtype=np.float64) * mission.horizon.dt
    x = np.stack([decode(evidence.flight_plan.trajectories[name]).evaluate(t) for name in evidence.names], axis=1)
    return seen_surface(mission, x[..., :3], x[..., 3])


def _heading(estimate: Series | None, t: Array) -> Array:
    """(len(t),) yaw [rad] as the drone told it nearest in time; NaN where it did not."""
    return _nearest(t, estimate.t, estimate["attitude"])[:, 2] if estimate is not None else np.full(len(t), np.nan)


def _nearest(t: Array, at: Array, values: Array) -> Array:
    """(len(t), 3) of the samples (S, 3) nearest in time; NaN where none is near: angles cannot be interpolated."""
    if len(at) == 0:
        return np.full((len(t), 3), np.nan)
    later = np.clip(np.searchsorted(at, t), 1, max(len(at) - 1, 1)).clip(max=len(at) - 1)
    index = np.where(np.abs(at[later - 1] - t) <= np.abs(at[later] - t), later - 1, later)
    return np.where(np.abs(at[index] - t)[:, None] <= GAP, values[index], np.nan)
