"""``ergoflie report``: a flight log → one HTML page, and the verdict on the terminal."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from deploy.cli.types import Subparsers


def add_parser(commands: Subparsers) -> None:
    """Add this command."""
    parser = commands.add_parser("report", help="turn a flight log into one self-contained HTML page and a verdict")
    parser.add_argument("log", type=Path, help="flight log (.mcap, also an unfinished .mcap.part)")
    parser.add_argument("-o", "--output", type=Path, help="HTML file to write [default: beside the log]")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Read, analyse, write the page, print the verdict."""
    from deploy.cli.reporting import print_analysis, write_report
    from deploy.flightlog.reader import read_log

    target = args.output or args.log.with_suffix("").with_suffix(".html")
    analysis = write_report(read_log(args.log), target)
    return print_analysis(analysis, target, as_json=args.json)
