"""``ergoflie control``: the operator's words to a flight that runs in another terminal."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from deploy.cli.types import Subparsers

PORT = 19800


def add_parser(commands: Subparsers) -> None:
    """Add this command."""
    parser = commands.add_parser("control", help="say a word to a flight on this computer: land, hold, abort, stop")
    parser.add_argument(
        "word",
        choices=("land", "hold", "abort", "stop"),
        help="land: everybody, where they are; hold: brake and hover; abort: back to the pads and land; "
        "stop: motors off, in whatever height",
    )
    parser.add_argument("--port", type=int, default=PORT, help=f"what 'fly --control' was given [default: {PORT}]")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Say it."""
    from deploy.control import tell

    print(tell(args.port, args.word))
    return 0
