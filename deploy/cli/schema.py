"""``ergoflie schema``: the JSON Schema of mission files, for editors."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from deploy.cli.types import Subparsers


def add_parser(commands: Subparsers) -> None:
    """Add this command."""
    parser = commands.add_parser("schema", help="print the JSON Schema of mission files, for editors")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print the schema."""
    from deploy.cli.console import print_json
    from missions.jsonschema import json_schema

    print_json(json_schema())
    return 0
