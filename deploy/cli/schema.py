"""``ergoflie schema``: the JSON Schema of mission or scenario files, for editors."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from deploy.cli.types import Subparsers


def add_parser(commands: Subparsers) -> None:
    """Add this command."""
    parser = commands.add_parser("schema", help="print the JSON Schema of mission or scenario files, for editors")
    parser.add_argument(
        "kind", choices=["mission", "scenario"], nargs="?", default="mission", help="of which files [default: mission]"
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print the schema."""
    from deploy.cli.console import print_json
    from deploy.scenario import jsonschema as scenarios
    from missions import jsonschema as missions

    print_json((scenarios if args.kind == "scenario" else missions).json_schema())
    return 0
