"""The object in the report: its surface, who saw which point of it when, and how much of the information that is."""

from __future__ import annotations

import numpy as np

from deploy.analysis.record import FlightAnalysis
from deploy.analysis.sights import certified_sights
from deploy.report.packing import packed
from deploy.report.tables import table
from deploy.report.words import number
from missions.schema import Mission


def thing_data(mission: Mission) -> dict[str, object] | None:
    """The surface as points to draw, nobody having seen any yet; None without an object."""
    surface = mission.object.surface if mission.object is not None else None
    if surface is None:
        return None
    return {
        "points": packed(surface.points),
        "normals": packed(surface.normals),
        "share": packed(surface.share / surface.share.max()),
        "radius": float(np.sqrt(surface.area / np.pi)),
        "sided": 2 if surface.two_sided else 1,
        "first": None,
    }


def seen_data(analysis: FlightAnalysis) -> dict[str, object] | None:
    """The same with the mission time [s] of every robot's first look at every point."""
    thing, seen = thing_data(analysis.flight_plan.mission), analysis.sights
    if thing is None or seen is None:
        return thing
    return {**thing, "first": packed(np.where(np.isfinite(seen.first), seen.first, np.nan))}


def thing_table(analysis: FlightAnalysis) -> str:
    """How much of the information each robot saw, and all of them; nothing without an object."""
    certified, flown = certified_sights(analysis), analysis.sights
    if certified is None:
        return ""
    rows = [
        [name, *(number(100.0 * each.fractions[k], 1) if each else "–" for each in (certified, flown))]
        for k, name in enumerate(analysis.names)
    ]
    rows.append(["together", *(number(100.0 * each.fraction, 1) if each else "–" for each in (certified, flown))])
    caption = "Information on the object that was seen; in the playback, points have the colour of who saw them first"
    return table(["robot", "certified [%]", "flown [%]"], rows, caption, (1, 2))
