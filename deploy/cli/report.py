"""``ergoflie report``: a flight log → one HTML page, and the verdict on the terminal; several logs → a comparison."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from deploy.cli.types import Subparsers

COMPARISON = "comparison.html"


def add_parser(commands: Subparsers) -> None:
    """Add this command."""
    parser = commands.add_parser(
        "report", help="turn a flight log into one self-contained HTML page and a verdict, or compare several"
    )
    parser.add_argument(
        "logs",
        metavar="LOG",
        nargs="+",
        type=Path,
        help="flight log (.mcap, also an unfinished .mcap.part); with several, all are compared with the first",
    )
    parser.add_argument(
        "-o", "--output", type=Path, help=f"HTML file to write [default: beside the log; {COMPARISON} beside the last]"
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument(
        "--fail-on",
        choices=("WARN", "FAIL"),
        default="FAIL",
        help="exit with 1 if a verdict is as bad as this [default: FAIL]",
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Read, analyse, write the page, print the verdict."""
    from deploy.cli.reporting import print_analysis, print_comparison, write_comparison, write_report
    from deploy.flightlog.reader import read_log

    records = [read_log(log) for log in args.logs]
    if len(records) > 1:
        target = args.output or args.logs[-1].with_name(COMPARISON)
        comparison = write_comparison(records, target)
        return print_comparison(comparison, target, as_json=args.json, fail_on=args.fail_on)
    target = args.output or args.logs[0].with_suffix("").with_suffix(".html")
    analysis = write_report(records[0], target)
    return print_analysis(analysis, target, as_json=args.json, fail_on=args.fail_on)
