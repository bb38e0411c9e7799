"""A certificate as the command line shows it: checks with margins, who connects with whom, when news arrive."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from deploy.cli.console import number, table

if TYPE_CHECKING:
    from planner.certificate.record import Certificate, Indicators


def print_certificate(certificate: Certificate, *, only_failed: bool = False) -> None:
    """The certificate, check by check; failures and warnings only if asked."""
    checks = [check for check in certificate.checks if not (only_failed and check.passed)]
    rows = [
        (
            "[red]✗[/]" if check.fails else "[green]✓[/]" if check.passed else "[yellow]![/]",
            check.name,
            _short(check.value),
            f"{'≤' if check.relation == '<=' else '≥'} {_short(check.limit)}",
            _short(check.margin),
            check.unit,
            check.where,
            "" if check.time is None else f"{check.time:.2f}",
        )
        for check in checks
    ]
    columns = ("", "check", "value", "limit", "margin", "unit", "where", "at s")
    table("certificate", columns, rows, right=(2, 3, 4, 7), whole=(2, 3, 4, 5, 7), least={1: 12})


def print_connections(found: Indicators) -> None:
    """Every pair: probabilities by sub-period, whether it met there, and how close it came; none without a range."""
    if not found.pairs or not math.isfinite(found.connected_share):
        return
    periods = len(found.pairs[0].met)
    columns = ("pair", *(f"P, met in {p + 1}" for p in range(periods)), "within range", "closest")
    rows = []
    for pair in found.pairs:
        P: Sequence[float] = pair.probability or (math.nan,) * periods
        cells = [f"{number(p)} {'yes' if met else '[red]no[/]'}" for p, met in zip(P, pair.met, strict=True)]
        rows.append(
            ("–".join(pair.robots), *cells, f"{pair.connected_share:.1%}", f"{number(pair.smallest_distance)} m")
        )
    table("connections by sub-period", columns, rows, right=tuple(range(1, periods + 3)))


def print_forwarding(found: Indicators, names: Sequence[str]) -> None:
    """When what a robot knows at the start can have reached another, from meeting to meeting."""
    if not found.arrivals or len(names) < 2:
        return

    def cell(i: int, j: int) -> str:
        arrival = found.arrivals[i][j]
        return "" if i == j else f"{arrival:.1f}" if math.isfinite(arrival) else "never"

    everybody = range(len(names))
    rows = [(name, *(cell(i, j) for j in everybody)) for i, name in enumerate(names)]
    table(
        "store and forward: earliest arrival in seconds",
        ("from \\ to", *names),
        rows,
        right=tuple(range(1, len(names) + 1)),
    )


def certificate_json(certificate: Certificate) -> dict[str, object]:
    """A certificate for machines, margins included."""
    checks = [{**dataclasses.asdict(check), "margin": check.margin} for check in certificate.checks]
    return {
        "passed": certificate.passed,
        "failures": [check.name for check in certificate.failures],
        "warnings": [check.name for check in certificate.warnings],
        **dataclasses.asdict(certificate),
        "checks": checks,
    }


def _short(value: float) -> str:
    """Three digits: a table of 80 columns has eight of these."""
    if math.isinf(value):
        return f"{'-' if value < 0 else ''}∞"
    return number(float(f"{value:.3g}"))
