"""Log to report and verdict, as the command line shows it."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING

from deploy.cli.console import number, out, print_json, table

if TYPE_CHECKING:
    from deploy.analysis.record import FlightAnalysis
    from deploy.flightlog.reader import FlightRecord

_COLOURS = {"PASS": "green", "WARN": "yellow", "FAIL": "red"}


def write_report(record: FlightRecord, target: Path) -> FlightAnalysis:
    """Analyse a flight and write its page (whole or not at all)."""
    from deploy.analysis.analyse import analyse
    from deploy.report import build_report

    analysis = analyse(record)
    part = target.with_name(target.name + ".part")
    part.write_text(build_report(analysis), encoding="utf-8")
    os.replace(part, target)
    return analysis


def print_analysis(analysis: FlightAnalysis, report: Path, *, as_json: bool) -> int:
    """Print figures and verdict; the exit code is 1 when the verdict is FAIL."""
    verdict = analysis.verdict
    if as_json:
        print_json({**analysis.summary(), "report": str(report)})
        return int(verdict.level.name == "FAIL")
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
        out.print(item.text, markup=False, soft_wrap=True)
    out.print(f"verdict: [bold {_COLOURS[verdict.level.name]}]{verdict.level.name}[/]")
    out.print(f"report: {report}", markup=False, soft_wrap=True)
    return int(verdict.level.name == "FAIL")
