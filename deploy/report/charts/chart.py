"""What a chart is: a title, a one-line reading that says what to do, and panels of curves over one time axis."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from deploy.analysis.record import FlightAnalysis
from deploy.flightlog.reader import Series
from deploy.report.packing import packed, thin
from deploy.report.playback import zero_time
from missions.arrays import Array

POINTS = 1000  # of a curve, at most: what a wide screen shows
Chart = dict[str, object]
Curve = dict[str, object]
Panel = dict[str, object]
Limit = dict[str, object]


def curve(
    name: str, t: Array, y: Array, *, robot: int | None = None, style: str = "flown", keep: str = "every"
) -> Curve:
    """A curve of y over mission times t [s]; ``keep`` as in :func:`deploy.report.packing.thin`."""
    t, y = thin(np.asarray(t), np.asarray(y), POINTS, keep)
    return {"name": name, "robot": robot, "style": style, "t": packed(t), "y": packed(y)}


def limit(y: float, name: str) -> Limit:
    """A line that is not to be crossed."""
    return {"y": y, "name": name}


def panel(unit: str, curves: Iterable[Curve], limits: Sequence[Limit] = (), **options: bool) -> Panel:
    """Curves of one unit; options: ``zero`` (the axis holds it), ``log``."""
    return {"unit": unit, "curves": list(curves), "limits": list(limits), **options}


def lines(group: str, name: str, title: str, reading: str, panels: Iterable[Panel], *, wide: bool = False) -> Chart:
    """A chart of panels, one above the other; panels without curves are left out.

    Args:
        group: part of the page it belongs to.
        name: of the chart, for links and tests.
        title: above it.
        reading: what it says and what to do, one line.
        panels: with a curve each, at least.
        wide: over the whole page.
    """
    filled = [item for item in panels if item["curves"]]
    return {
        "group": group,
        "id": name,
        "title": title,
        "reading": sentence(reading),
        "kind": "lines",
        "panels": filled,
        "wide": wide,
    }


def per_robot(
    analysis: FlightAnalysis, topic: str, pick: str | Callable[[Series], Array], scale: float = 1.0, keep: str = "every"
) -> Iterator[Curve]:
    """A curve for every robot that has such records: a field, or what is worked out of the series."""
    zero = zero_time(analysis)
    for i, robot in enumerate(analysis.flight_plan.mission.robots):
        series = analysis.record.of(robot.name, topic)
        if series is None or not len(series):
            continue
        values = series[pick] if isinstance(pick, str) else pick(series)
        if np.isfinite(values).any():
            yield curve(robot.name, series.t - zero, scale * values, robot=i, keep=keep)


def sentence(text: str) -> str:
    """With a capital and a full stop."""
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")
