"""Charts of the search: ergodicity as it falls, and who could talk to whom."""

from __future__ import annotations

import numpy as np

from deploy.analysis.meetings import PairMeetings
from deploy.analysis.record import FlightAnalysis
from deploy.report.charts.chart import Chart, curve, lines, panel, sentence
from deploy.report.words import scientific
from missions.arrays import Array
from missions.topology import sub_period_times

_LOSS = 0.25  # of the certified ergodicity that a flight may lose to tracking without a word
_RATE = 10.0  # Hz at which groups are counted


def ergodicity(analysis: FlightAnalysis) -> Chart:
    """E of everything up to then: planned, certified, flown."""
    found = analysis.coverage
    curves = [
        curve("planned", found.t, found.planned_over_time, style="planned"),
        curve("certified", found.t, found.certified_over_time, style="certified"),
    ]
    if np.isfinite(found.flown_over_time).any():
        curves.append(curve("flown", found.t, found.flown_over_time))
    planned, certified = found.planned.ergodicity, found.certified.ergodicity
    reading = f"{scientific(planned)} planned, {scientific(certified)} certified"
    if found.flown is None:
        reading += "; too little of the search was seen to say what was flown"
    else:
        change = found.flown.ergodicity / certified - 1.0 if certified > 0.0 else 0.0
        reading += f", {scientific(found.flown.ergodicity)} flown: "
        if change > _LOSS:
            reading += f"{change * 100:.0f} % worse than certified, lost to tracking: look at its error below"
        else:
            reading += f"{abs(change) * 100:.0f} % {'more' if change > 0 else 'less'}, nothing to do"
    return lines("search", "ergodicity", "Ergodicity so far", reading, [panel("E, log scale", curves, log=True)])


def groups(analysis: FlightAnalysis) -> Chart | None:
    """Into how many groups the swarm falls, messages being passed on."""
    mission = analysis.flight_plan.mission
    names = [robot.name for robot in mission.robots]
    if not analysis.meetings or len(names) < 3:
        return None
    t = np.arange(0.0, mission.horizon.duration + 1e-9, 1.0 / _RATE)
    certified = _count(t, analysis.meetings, names, flown=False)
    curves = [curve("certified", t, certified, style="certified")]
    reading = f"certified: everybody is connected for {(certified == 1.0).mean() * 100:.0f} % of the search"
    if analysis.window is not None and analysis.motion is not None:
        flown_t = t[t < analysis.window.end - analysis.window.start - 1.0 / _RATE]
        flown = _count(flown_t, analysis.meetings, names, flown=True)
        curves.append(curve("flown", flown_t, flown))
        reading = f"everybody was connected, directly or by others, for {(flown == 1.0).mean() * 100:.0f} % of the time"
        reading += f" (certified {(certified == 1.0).mean() * 100:.0f} %): for more ask for a higher threshold"
    return lines("search", "groups", "Groups of robots within reach of each other", reading, [panel("groups", curves)])


def meetings(analysis: FlightAnalysis) -> Chart | None:
    """When each pair was within range: bars in flight, outlines by plan."""
    if not analysis.meetings:
        return None
    mission = analysis.flight_plan.mission
    reach = mission.connectivity.range
    missed = ["–".join(pair.robots) for pair in analysis.meetings if pair.met and not all(pair.met)]
    met = sum(bool(pair.flown) for pair in analysis.meetings)
    reading = f"{met} of {len(analysis.meetings)} pairs came within {reach:g} m in flight"
    if missed:
        reading += f"; not in every sub-period: {', '.join(missed[:4])}{' …' if len(missed) > 4 else ''}. "
        reading += "Where the outline stays empty look at tracking, else ask for a higher threshold"
    else:
        reading += "; outlines are the plan, vertical lines the sub-periods"
    return {
        "group": "search",
        "id": "connectivity",
        "title": "Who was in range of whom",
        "unit": f"within {reach:g} m",
        "reading": sentence(reading),
        "kind": "spans",
        "wide": True,
        "rows": [
            {"name": "–".join(pair.robots), "planned": pair.certified, "flown": pair.flown}
            for pair in analysis.meetings
        ],
        "periods": list(sub_period_times(mission)),
    }


def _count(t: Array, pairs: tuple[PairMeetings, ...], names: list[str], flown: bool) -> Array:
    """(T,) number of connected components of the graph of those within range."""
    index = {name: i for i, name in enumerate(names)}
    group = np.tile(np.arange(len(names)), (len(t), 1))  # (T, N) smallest robot known to be in one's group
    links = []
    for pair in pairs:
        near = np.zeros(len(t), dtype=bool)
        for begin, end in pair.flown if flown else pair.certified:
            near |= (t >= begin - 1e-9) & (t <= end + 1e-9)
        links.append((index[pair.robots[0]], index[pair.robots[1]], near))
    for _ in names:  # a label travels one link a round
        for i, j, near in links:
            least = np.minimum(group[:, i], group[:, j])
            group[near, i] = group[near, j] = least[near]
    own: Array = (group == np.arange(len(names))).sum(axis=1).astype(np.float64)
    return own
