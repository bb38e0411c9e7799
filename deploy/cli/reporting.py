"""Log to report and verdict, as the command line shows it."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING

from rich.markup import escape

from deploy.cli.console import number, out, print_json, table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from deploy.analysis.compare import Comparison
    from deploy.analysis.record import FlightAnalysis
    from deploy.flightlog.reader import FlightRecord

_COLOURS = {"PASS": "green", "WARN": "yellow", "FAIL": "red"}


def write_report(record: FlightRecord, target: Path) -> FlightAnalysis:
    """Analyse a flight and write its page (whole or not at all)."""
    from deploy.analysis.analyse import analyse
    from deploy.report import build_report

    analysis = analyse(record)
    _write(target, build_report(analysis))
    return analysis


def write_comparison(records: Sequence[FlightRecord], target: Path) -> Comparison:
    """Analyse flights and write the page that compares them."""
    from deploy.analysis.analyse import analyse
    from deploy.analysis.compare import compare
    from deploy.report import build_comparison

    comparison = compare([analyse(record) for record in records])
    _write(target, build_comparison(comparison))
    return comparison


def _write(target: Path, page: str) -> None:
    part = target.with_name(target.name + ".part")
    part.write_text(page, encoding="utf-8")
    os.replace(part, target)


def print_analysis(analysis: FlightAnalysis, report: Path, *, as_json: bool, fail_on: str = "FAIL") -> int:
    """Print figures and verdict; the exit code is 1 when the verdict is as bad as ``fail_on`` (WARN or FAIL)."""
    verdict = analysis.verdict
    if as_json:
        print_json({**analysis.summary(), "report": str(report)})
        return int(_fails(analysis, fail_on))
    covered = analysis.coverage
    flown = number(covered.flown.ergodicity) if covered.flown else "–"
    rows = [
        ("ergodicity E of the plan", number(covered.planned.ergodicity)),
        ("ergodicity E of the certified polynomials", number(covered.certified.ergodicity)),
        ("ergodicity E of the flight", flown),
    ]
    rows += [
        (f"tracking error of {item.robot}, mean / largest", f"{item.mean * 100:.1f} / {item.largest * 100:.1f} cm")
        for item in analysis.tracking
    ]
    if analysis.separation is not None and math.isfinite(analysis.separation.smallest):
        rows.append(("smallest separation flown", f"{number(analysis.separation.smallest)} m"))
    table(f"{analysis.flight_plan.mission.name}: flight", ("figure", "value"), rows)
    for item in verdict.findings:
        out.print(f"[{_COLOURS[item.level.name]}]{item.level.name}[/] ", end="")
        out.print(f"{item.name}: {item.text}" if item.cause else item.text, markup=False, soft_wrap=True)
        if item.remedy:
            out.print(f"     → {item.remedy}", markup=False, soft_wrap=True, style="dim")
    out.print(f"verdict: [bold {_COLOURS[verdict.level.name]}]{verdict.level.name}[/]")
    out.print(f"report: {report}", markup=False, soft_wrap=True)
    return int(_fails(analysis, fail_on))


def print_comparison(comparison: Comparison, report: Path, *, as_json: bool, fail_on: str) -> int:
    """Print the figures side by side; the exit code is 1 when a flight's verdict is as bad as ``fail_on``."""
    code = int(any(_fails(flight, fail_on) for flight in comparison.flights))
    if as_json:
        print_json({**comparison.summary(), "report": str(report)})
        return code
    flights = range(len(comparison.flights))
    rows = [("verdict", *(f"[{_COLOURS[name]}]{name}[/]" for name in _verdicts(comparison)))]
    for item in comparison.figures:
        cells = (number(value) for value in item.values)
        marked = (f"[red]{cell}[/]" if item.worse(k) else cell for k, cell in zip(flights, cells, strict=True))
        rows.append((escape(f"{item.name} [{item.unit}]") if item.unit else item.name, *marked))
    table("flights compared; red: notably worse than the first", ("figure", *comparison.labels), rows)
    out.print(f"report: {report}", markup=False, soft_wrap=True)
    return code


def _verdicts(comparison: Comparison) -> list[str]:
    return [flight.verdict.level.name for flight in comparison.flights]


def _fails(analysis: FlightAnalysis, fail_on: str) -> bool:
    from deploy.analysis.findings import Level

    return analysis.verdict.level >= Level[fail_on]
