"""``ergoflie log``: what is in a flight log, as tables, whole again after a crash, or laid out in a viewer."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from deploy.cli.types import Subparsers
    from deploy.flightlog.reader import FlightRecord


def add_parser(commands: Subparsers) -> None:
    """Add this command and its own."""
    parser = commands.add_parser("log", help="what is in a flight log; as tables; recovered; laid out in a viewer")
    own = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    info = own.add_parser("info", help="topics with counts and rates, attachments, provenance, what is missing")
    info.add_argument("log", type=Path, help="flight log (.mcap, also an unfinished .mcap.part)")
    info.add_argument("--json", action="store_true", help="print it as JSON")
    info.set_defaults(run=_info)
    export = own.add_parser("export", help="a table a topic: CSV, or Parquet (pip install 'ergoflie[parquet]')")
    export.add_argument("log", type=Path, help="flight log (.mcap, also an unfinished .mcap.part)")
    export.add_argument("-o", "--output", metavar="DIR", type=Path, required=True, help="folder for the tables")
    export.add_argument("--format", choices=["csv", "parquet"], default="csv", help="[default: csv]")
    export.add_argument("--topics", metavar="TOPIC", nargs="+", help="names or patterns, e.g. '/cf1/*' [default: all]")
    export.set_defaults(run=_export)
    recover = own.add_parser("recover", help="a complete log of what is intact in one that was cut or damaged")
    recover.add_argument("log", type=Path, help="damaged or unfinished log; it stays as it is")
    recover.add_argument("-o", "--output", metavar="LOG", type=Path, required=True, help="log to write (.mcap)")
    recover.set_defaults(run=_recover)
    layout = own.add_parser("layout", help="a layout file for Foxglove and Lichtblick")
    layout.add_argument("file", type=Path, nargs="?", help="plan or log whose robots it is for [default: cf1 … cf4]")
    layout.add_argument(
        "-o", "--output", type=Path, default=Path("ergoflie.layout.json"), help="[default: ergoflie.layout.json]"
    )
    layout.set_defaults(run=_layout)
    topics = own.add_parser("topics", help="the table of all topics: schema, unit, frame, clock, rate")
    topics.set_defaults(run=_topics)


def _info(args: argparse.Namespace) -> int:
    from deploy.cli.console import out, print_json, table
    from deploy.flightlog.reader import read_log

    record = read_log(args.log)
    facts = _facts(record)
    if args.json:
        print_json(facts)
        return 0
    rows = [
        (name, str(len(series)), f"{_rate(series.t):.1f}", f"{series.t[0]:.2f} … {series.t[-1]:.2f}")
        for name, series in record.series.items()
        if len(series)
    ]
    table(f"{record.path}", ("topic", "records", "Hz", "flight time [s]"), rows, right=(1, 2), whole=(0, 3))
    out.print("robots: " + ", ".join(record.robots), markup=False)
    for name, data in record.attachments.items():
        out.print(f"attachment {name}: {len(data)} bytes", markup=False)
    for name, value in record.metadata.items():
        if "\n" not in value:
            out.print(f"{name}: {value}", markup=False)
    out.print("complete" if record.complete else "not complete")
    for problem in record.problems:
        out.print(f"  {problem}", markup=False, soft_wrap=True)
    return 0


def _facts(record: FlightRecord) -> dict[str, object]:
    return {
        "path": record.path,
        "complete": record.complete,
        "problems": record.problems,
        "robots": record.robots,
        "epoch": record.epoch,
        "dropped": record.dropped,
        "topics": {
            name: {"records": len(series), "rate": _rate(series.t), "begin": series.t[0], "end": series.t[-1]}
            for name, series in record.series.items()
            if len(series)
        },
        "attachments": {name: len(data) for name, data in record.attachments.items()},
        "metadata": dict(record.metadata),
    }


def _export(args: argparse.Namespace) -> int:
    from deploy.cli.console import out
    from deploy.flightlog.export import export
    from deploy.flightlog.reader import read_log

    for path, rows in export(read_log(args.log), args.output, args.format, args.topics or ()):
        out.print(f"{path}: {rows} rows", markup=False, soft_wrap=True)
    return 0


def _recover(args: argparse.Namespace) -> int:
    from deploy.cli.console import out
    from deploy.flightlog.recover import recover

    found = recover(args.log, args.output)
    out.print(f"{args.output}: {found.messages} records, {found.attachments} attachments", markup=False, soft_wrap=True)
    for problem in found.problems:
        out.print(f"  {problem}", markup=False, soft_wrap=True)
    return 0


def _layout(args: argparse.Namespace) -> int:
    from deploy.cli.console import out
    from deploy.files import write_whole
    from deploy.flightlog.layout import layout
    from deploy.flightlog.reader import robots_in

    robots = ("cf1", "cf2", "cf3", "cf4") if args.file is None else robots_in(args.file)
    write_whole(args.output, json.dumps(layout(robots), indent=1).encode())
    out.print(f"{args.output}: layout for {', '.join(robots)}", markup=False, soft_wrap=True)
    return 0


def _topics(args: argparse.Namespace) -> int:
    from deploy.flightlog.topics import markdown

    print(markdown())
    return 0


def _rate(t: object) -> float:
    """Mean rate [Hz] of n times; 0 of one."""
    import numpy as np

    times = np.asarray(t, dtype=np.float64)
    span = float(times[-1] - times[0]) if len(times) > 1 else 0.0
    return (len(times) - 1) / span if span > 0.0 else 0.0
