"""The head of the page: the verdict with the three reasons that matter, and what was diagnosed."""

from __future__ import annotations

from html import escape

from deploy.analysis.findings import Finding, Level
from deploy.analysis.record import FlightAnalysis
from deploy.report.playback import zero_time
from deploy.report.tables import moment

_SYMBOLS = {Level.PASS: "✓", Level.WARN: "!", Level.FAIL: "✕"}
_WORDS = {
    Level.PASS: "The flight did what was planned.",
    Level.WARN: "The flight was flown, with reservations.",
    Level.FAIL: "The flight did not do what was planned.",
}


def verdict(analysis: FlightAnalysis) -> str:
    """The verdict, its reasons, and everything else that was judged."""
    level, reasons = analysis.verdict.level, analysis.verdict.reasons
    rest = [item for item in analysis.verdict.findings if item not in reasons]
    more = ""
    if rest:
        listing = "".join(_line(item) for item in rest)
        more = f"<details><summary>{len(rest)} more findings</summary><ul>{listing}</ul></details>"
    listed = "".join(_line(item) for item in reasons)
    return (
        f'<div class="verdict {level.name.lower()}"><p class="level">{level.name}</p>'
        f'<div><p class="words">{_WORDS[level]}</p><ul>{listed}</ul>{more}</div></div>'
    )


def diagnoses(analysis: FlightAnalysis) -> str:
    """Why it went so, and what to do: empty for a flight without a fault."""
    zero = zero_time(analysis)
    items = []
    for item in analysis.verdict.diagnoses:
        when = "" if item.t is None else " " + moment(item.t - zero, f"go to {item.t - zero:.1f} s")
        remedy = f'<p class="remedy">{escape(item.remedy)}</p>' if item.remedy else ""
        name, text = escape(item.name), escape(item.text)
        items.append(f'<li class="{item.level.name.lower()}"><h3>{name}</h3><span>{text}</span>{when}{remedy}</li>')
    if not items:
        return ""
    return f'<section id="diagnoses"><h2>Diagnosis</h2><ul class="causes">{"".join(items)}</ul></section>'


def _line(item: Finding) -> str:
    mark = f'<span class="mark {item.level.name.lower()}" aria-label="{item.level.name}">{_SYMBOLS[item.level]}</span>'
    return f"<li>{mark}<span><b>{escape(item.name)}</b> {escape(item.text)}</span></li>"
