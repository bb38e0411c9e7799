"""Several flights on one page: real against rehearsed, before against after."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from html import escape

import numpy as np

from deploy.analysis.compare import Comparison, Figure
from deploy.analysis.record import FlightAnalysis
from deploy.report.charts.chart import Chart, Curve, curve, lines, panel
from deploy.report.packing import packed
from deploy.report.page import PLAYED, Kind, fill, playback
from deploy.report.playback import flown_positions, playback_data, zero_time
from deploy.report.tables import Markup, table
from deploy.report.words import number, scientific
from missions.arrays import Array

_COMPARISON = Kind("report/compare.html", PLAYED)
_STEP = 0.1  # s of the curves that are a mean or an extreme over robots


def build_comparison(comparison: Comparison) -> str:
    """The page of a comparison; curves have the colours of their flights."""
    first = comparison.flights[0].flight_plan.mission
    title = " · ".join(comparison.labels)
    data = {"playback": _playback(comparison), "charts": list(_charts(comparison)), "maps": None}
    return fill(
        _COMPARISON,
        data,
        title=escape(f"{first.name}: {title}"),
        name=escape(title),
        kind="flights compared",
        under={"lede": escape(_about(comparison))},
        verdicts=_verdicts(comparison),
        changes=_changes(comparison),
        figures=_figures(comparison),
        robots=_robots(comparison),
        playback=playback(_playback_words(comparison)),
    )


def _about(comparison: Comparison) -> str:
    names = sorted({flight.flight_plan.mission.name for flight in comparison.flights})
    bytes_ = "the same bytes flew in all of them" if comparison.same_bytes else "other trajectories flew in each"
    kinds = ", ".join(
        f"{label}: {'rehearsal' if flight.simulated else 'hardware'}"
        for label, flight in zip(comparison.labels, comparison.flights, strict=True)
    )
    return f"{', '.join(names)}; {bytes_} ({kinds})"


def _verdicts(comparison: Comparison) -> str:
    """A card a flight: its verdict and its reasons."""
    cards = []
    for k, (label, flight) in enumerate(zip(comparison.labels, comparison.flights, strict=True)):
        level = flight.verdict.level.name
        reasons = "".join(f"<li><b>{escape(item.name)}</b> {escape(item.text)}</li>" for item in flight.verdict.reasons)
        cards.append(
            f'<div class="verdict {level.lower()}" style="--c: var(--r{k % 10})"><p class="level">{level}</p>'
            f'<div><p class="words flight">{escape(label)}</p><ul>{reasons}</ul></div></div>'
        )
    return "".join(cards)


def _changes(comparison: Comparison) -> str:
    """What is notably different from the first flight, worst first."""
    items = []
    for k, label in enumerate(comparison.labels[1:], 1):
        notable = [item for item in comparison.figures if item.worse(k)]
        notable += [item for item in comparison.figures if item.improved(k)]
        for item in notable:
            kind, word = ("warn", "worse") if item.worse(k) else ("pass", "better")
            text = f"{_value(item, 0)} → {_value(item, k)} {item.unit}".strip()
            said = escape(f"{text}: {word} in {label}")
            items.append(f'<li class="{kind}"><h3>{escape(item.name)}</h3><span>{said}</span></li>')
    if not items:
        return "<p>Nothing changed notably.</p>"
    return f'<ul class="causes two">{"".join(items)}</ul>'


def _figures(comparison: Comparison) -> str:
    rows = []
    for item in comparison.figures:
        row = [f"{item.name} [{item.unit}]" if item.unit else item.name]
        for k in range(len(comparison.flights)):
            mark = "worse" if item.worse(k) else "better" if item.improved(k) else ""
            row.append(Markup(f'<span class="{mark}">{escape(_value(item, k))}</span>'))
        rows.append(row)
    caption = "Every figure; what differs notably from the first flight is marked"
    columns = tuple(range(1, len(comparison.flights) + 1))
    return table(["", *comparison.labels], rows, caption, columns)


def _value(item: Figure, k: int) -> str:
    value = item.values[k]
    if item.name.startswith("ergodicity"):
        return scientific(value)
    return number(value, 0 if item.unit in {"ms", "Hz", "s", "%"} and abs(value) >= 10.0 else 2)


def _robots(comparison: Comparison) -> str:
    """Mean tracking error and lag of each robot in each flight."""
    names = list(dict.fromkeys(item.robot for flight in comparison.flights for item in flight.tracking))
    rows = []
    for name in names:
        row = [name]
        for flight in comparison.flights:
            own = next((item for item in flight.tracking if item.robot == name), None)
            row += [number(100 * own.mean if own else None, 1), number(1000 * own.mean_lag if own else None, 0)]
        rows.append(row)
    if not rows:
        return ""
    headings = ["robot", *(f"{label}: {word}" for label in comparison.labels for word in ("error [cm]", "lag [ms]"))]
    return table(headings, rows, "Mean tracking error and lag", tuple(range(1, len(headings))))


def _playback(comparison: Comparison) -> dict[str, object]:
    """The first flight, with the second in the place of the plan where the same robots flew."""
    first, second = comparison.flights[:2]
    data = playback_data(first)
    if comparison.same_robots:
        n, begin, step = data["n"], data["t0"], data["dt"]
        assert isinstance(n, int) and isinstance(begin, float) and isinstance(step, float)  # noqa: S101, PT018
        data["planned"] = packed(flown_positions(second, begin + step * np.arange(n, dtype=np.float64)))
    return data


def _playback_words(comparison: Comparison) -> str:
    first, second = (escape(label) for label in comparison.labels[:2])
    ghost = second if comparison.same_robots else "certified plan"
    return f"Solid: {first}. Dashed and hollow: {ghost}. Searches begin together, at 0 s."


def _charts(comparison: Comparison) -> Iterator[Chart]:
    """One curve a flight each."""

    def over(pick: Callable[[FlightAnalysis], tuple[Array, Array] | None]) -> list[Curve]:
        found = [(k, pick(flight)) for k, flight in enumerate(comparison.flights)]
        return [
            {**curve(comparison.labels[k], *item), "flight": k}
            for k, item in found
            if item is not None and len(item[0])
        ]

    charts = (
        ("ergodicity", "Ergodicity so far", "E, log scale", "of everything up to then; less is better", _ergodicity),
        ("tracking", "Tracking error", "cm, mean of all robots", "where curves part, look at the playback", _error),
        ("separation", "Smallest separation", "m, between any two", "of all robots, heights scaled", _separation),
        ("battery", "Battery", "V, lowest of all robots", "what falls faster worked harder, or is worn", _battery),
        ("link", "Radio latency", "ms, slowest of all robots", "a rehearsal's radio is modelled", _latency),
    )
    for name, title, unit, reading, pick in charts:
        curves = over(pick)
        if curves:
            yield lines("all", name, title, reading, [panel(unit, curves, log=name == "ergodicity")])


def _ergodicity(flight: FlightAnalysis) -> tuple[Array, Array]:
    return flight.coverage.t, flight.coverage.flown_over_time


def _error(flight: FlightAnalysis) -> tuple[Array, Array] | None:
    if not flight.tracking:
        return None
    errors = np.stack([item.error for item in flight.tracking])
    known = np.isfinite(errors)
    count = known.sum(axis=0)
    total = np.where(known, errors, 0.0).sum(axis=0)
    return flight.tracking[0].t, 100.0 * np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _separation(flight: FlightAnalysis) -> tuple[Array, Array] | None:
    found = flight.separation
    return None if found is None else (found.t - zero_time(flight), found.distance)


def _battery(flight: FlightAnalysis) -> tuple[Array, Array] | None:
    return _extreme(flight, "battery", "voltage", np.fmin)


def _latency(flight: FlightAnalysis) -> tuple[Array, Array] | None:
    return _extreme(flight, "link", "latency_ms", np.fmax)


def _extreme(flight: FlightAnalysis, topic: str, field: str, pick: np.ufunc) -> tuple[Array, Array] | None:
    """The extreme over all robots, on one grid."""
    series = [flight.record.of(robot.name, topic) for robot in flight.flight_plan.mission.robots]
    known = [item for item in series if item is not None and np.isfinite(item[field]).sum() > 1]
    if not known:
        return None
    t = np.arange(min(item.t[0] for item in known), max(item.t[-1] for item in known), _STEP)
    columns = []
    for item in known:
        finite = np.isfinite(item[field])
        columns.append(np.interp(t, item.t[finite], item[field][finite], left=np.nan, right=np.nan))
    return t - zero_time(flight), pick.reduce(np.stack(columns), axis=0)
