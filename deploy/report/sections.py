"""The parts of the page that are words and tables; every text that comes from outside is escaped here."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from html import escape

from deploy.analysis.record import FlightAnalysis
from deploy.report.playback import zero_time
from deploy.report.tables import moment, table
from deploy.report.words import number, scientific
from planner.certificate.record import Check

_MOST_EVENTS = 400


def figures(analysis: FlightAnalysis) -> str:
    """The key figures as tiles."""
    covered, apart = analysis.coverage, analysis.separation
    flown = covered.flown
    errors = [item.mean for item in analysis.tracking if not math.isnan(item.mean)]
    batteries = [item.smallest for item in analysis.batteries if not math.isnan(item.smallest)]
    met = "–"
    if flown is not None and analysis.meetings:
        met = f"{sum(all(pair.met) for pair in analysis.meetings)} of {len(analysis.meetings)}"
    tiles = [
        ("Ergodicity flown", scientific(flown.ergodicity if flown else math.nan), "E of the search as it was flown"),
        ("certified", scientific(covered.certified.ergodicity), "E of the bytes that were uploaded"),
        ("planned", scientific(covered.planned.ergodicity), "E of the solver's plan"),
        ("Tracking error", number(100 * sum(errors) / len(errors) if errors else None, 1, "cm"), "mean of all robots"),
        ("Separation", number(apart.smallest if apart else None, 2, "m"), "smallest of the flight"),
        ("Pairs that met", met, "in every sub-period"),
        ("Battery", number(min(batteries, default=math.nan), 2, "V"), "lowest of the flight"),
    ]
    return "".join(
        f'<div class="tile"><dt>{name}</dt><dd>{escape(value)}</dd><p>{note}</p></div>' for name, value, note in tiles
    )


def indicators_table(analysis: FlightAnalysis) -> str:
    """The papers' indicators for plan, bytes and flight side by side."""
    found = analysis.coverage
    columns = [found.planned, found.certified, found.flown]

    def row(name: str, values: Iterable[str]) -> list[str]:
        return [name, *values]

    def each(field: str, digits: int) -> list[str]:
        return [number(getattr(item, field), digits) if item else "–" for item in columns]

    rows = [
        row("Ergodicity E", [scientific(item.ergodicity) if item else "–" for item in columns]),
        row("Share of pair-times within range", each("connected_share", 3)),
        row("Worst connection probability P", each("probability_worst", 3)),
        row("Mean connection probability P", each("probability_mean", 3)),
        row("Every pair met in every sub-period", [_yes(item.all_met) if item else "–" for item in columns]),
        row("Smallest separation [m]", each("smallest_separation", 3)),
        row("Smallest obstacle clearance [m]", each("smallest_clearance", 3)),
    ]
    return table(["", "planned", "certified", "flown"], rows, "Indicators of the search", (1, 2, 3))


def probability_table(analysis: FlightAnalysis) -> str:
    """P per pair and sub-period, certified and flown, and whether they truly met."""
    pairs = [pair for pair in analysis.meetings if pair.probability_certified]
    if not pairs:
        return ""
    threshold = getattr(analysis.flight_plan.mission.connectivity, "threshold", None)
    count = max(len(pair.probability_certified) for pair in pairs)
    headings = ["pair", *(f"{i + 1}: {word}" for i in range(count) for word in ("certified", "flown", "met"))]
    rows = []
    for pair in pairs:
        row = ["–".join(pair.robots)]
        for i in range(count):
            flown = number(pair.probability_flown[i], 3) if pair.probability_flown else "–"
            row += [number(pair.probability_certified[i], 3), flown, _yes(pair.met[i]) if pair.met else "–"]
        rows.append(row)
    asked = f"; the mission asks for at least {threshold:g}" if threshold is not None else ""
    caption = f"Connection probability P by sub-period{asked}"
    return table(headings, rows, caption, tuple(range(1, 3 * count + 1)))


def forwarding_table(analysis: FlightAnalysis) -> str:
    """When what one robot knows at the start can have reached another, from meeting to meeting."""
    certified, flown = analysis.coverage.certified, analysis.coverage.flown
    names = [robot.name for robot in analysis.flight_plan.mission.robots]
    if not certified.arrivals or len(names) < 2:
        return ""

    def arrival(table: Sequence[Sequence[float]], i: int, j: int) -> str:
        return f"{table[i][j]:.1f}" if math.isfinite(table[i][j]) else "never"

    def cell(i: int, j: int) -> str:
        if i == j:
            return ""
        in_flight = arrival(flown.arrivals, i, j) if flown and flown.arrivals else "–"
        return f"{arrival(certified.arrivals, i, j)} / {in_flight}"

    everybody = range(len(names))
    rows = [[name, *(cell(i, j) for j in everybody)] for i, name in enumerate(names)]
    caption = "Store and forward: earliest time [s] at which a message of the start can reach, certified / flown"
    return table(["from \\ to", *names], rows, caption, tuple(range(1, len(names) + 1)))


def robots_table(analysis: FlightAnalysis) -> str:
    """One line a robot, twice: how it flew and on which battery, and what came through the air."""
    flown, heard = [], []
    tracks = {item.robot: item for item in analysis.tracking}
    for battery, link, feed in zip(analysis.batteries, analysis.links, analysis.feeds, strict=True):
        track = tracks.get(battery.robot)
        errors = (track.mean, track.p95, track.largest) if track else (math.nan,) * 3
        flown.append(
            [
                battery.robot,
                *(number(100 * value, 1) for value in errors),
                number(1000 * track.mean_lag if track else None, 0),
                *(number(value) for value in (battery.start, battery.smallest, battery.sag)),
                number(battery.left / 60.0, 1),
            ]
        )
        heard.append(
            [
                battery.robot,
                *(number(value, 1) for value in (link.latency_median, link.latency_p95, link.quality_smallest)),
                number(link.rssi, 0),
                number(link.rate, 0),
                str(link.lost) if link.reports else "–",
                number(feed.rate, 0),
                number(1000 * feed.jitter, 1),
                number(feed.longest_gap, 2),
            ]
        )
    headings = ["robot", "mean [cm]", "95 % [cm]", "largest [cm]", "lag [ms]"]
    headings += ["start [V]", "lowest [V]", "sag [V]", "left [min]"]
    caption = "Tracking error; battery, and how long the search could have gone on"
    motion = table(headings, flown, caption, tuple(range(1, len(headings))))
    headings = ["robot", "latency [ms]", "95 % [ms]", "acknowledged [%]", "signal [-dBm]", "packets [1/s]", "lost"]
    headings += ["poses [Hz]", "jitter [ms]", "longest gap [s]"]
    return motion + table(headings, heard, "Radio and motion capture", tuple(range(1, len(headings))))


def certificate_table(analysis: FlightAnalysis) -> str:
    """What was proved of the bytes before they flew."""
    rows = [
        [
            "✕" if check.fails else "✓" if check.passed else "!",
            check.name,
            f"{check.value:.4g} {check.unit}",
            _limit(check),
            check.where,
            number(check.time, 2, "s"),
        ]
        for check in analysis.flight_plan.certificate.checks
    ]
    return table(["", "check", "worst value", "allowed", "where", "when"], rows, "Certificate of the bytes", (2, 3, 5))


def _limit(check: Check) -> str:
    sign = {">=": "≥", "<=": "≤"}[check.relation]
    tolerance = f" (within {check.tolerance:.2g})" if check.tolerance else ""
    return f"{sign} {check.limit:.4g} {check.unit}{tolerance}"


def events_table(analysis: FlightAnalysis) -> str:
    """Everything that happened, in mission time."""
    zero = zero_time(analysis)
    events = [event for event in analysis.record.events if event.name != "preflight"]
    rows = [
        [moment(event.t - zero, f"{event.t - zero:.2f}"), event.phase, event.robot, event.level, event.name, event.text]
        for event in events[:_MOST_EVENTS]
    ]
    caption = "Events; time in seconds since the start of the search"
    if len(events) > _MOST_EVENTS:
        caption += f" (the first {_MOST_EVENTS} of {len(events)})"
    return table(["t [s]", "phase", "robot", "level", "event", "text"], rows, caption, (0,))


def provenance_table(analysis: FlightAnalysis) -> str:
    """Where all this comes from: versions, seeds, hashes, the state of the log."""
    record, plan = analysis.record, analysis.flight_plan
    source = plan.mission.source
    rows = [
        ["flown", "simulated" if analysis.simulated else "on hardware"],
        ["began", _date(record.epoch, analysis.simulated)],
        ["log", "complete" if record.complete else "incomplete: " + "; ".join(record.problems)],
        ["records dropped", str(record.dropped)],
        ["positions from", {"pose": "motion capture", "estimate": "the drones' own estimates"}[analysis.motion.source]]
        if analysis.motion
        else ["positions from", "nowhere"],
        ["mission SHA-256", source.sha256 if source else "–"],
        ["plan seed", str(plan.plan.seed)],
        ["planned with", ", ".join(f"{name} {version}" for name, version in sorted(plan.versions.items()))],
    ]
    hidden = {"format", "clock_epoch_ns", "simulation", *plan.versions}
    rows += [[name, value] for name, value in sorted(record.metadata.items()) if name not in hidden]
    return table(["", ""], rows, "Provenance")


def simulation(analysis: FlightAnalysis) -> str:
    """What the simulation models, in its own words; empty for hardware flights."""
    text = analysis.record.metadata.get("simulation", "")
    if not analysis.simulated or not text:
        return ""
    return (
        "<section id=simulation><h2>What the simulation covers</h2>"
        f'<details><summary>modelled, ideal, absent</summary><pre tabindex="0">{escape(text)}</pre></details></section>'
    )


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _date(epoch: float, simulated: bool) -> str:
    if simulated:
        return "simulated time"
    return datetime.fromtimestamp(epoch, tz=UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
