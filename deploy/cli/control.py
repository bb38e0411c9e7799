"""``ergoflie control``: the operator's words to a flight that runs in another terminal, and maps that have changed."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from deploy.cli.types import Subparsers

PORT = 19800


def add_parser(commands: Subparsers) -> None:
    """Add this command."""
    parser = commands.add_parser(
        "control", help="say a word to a flight on this computer: land, hold, abort, stop, or tell it another map"
    )
    parser.add_argument(
        "word",
        choices=("land", "hold", "abort", "stop", "map"),
        help="land: everybody, where they are; hold: brake and hover; abort: back to the pads and land; "
        "stop: motors off, in whatever height; map: the information is another, see --file",
    )
    parser.add_argument(
        "--file", metavar="MAP", type=Path, help="with map: YAML of what a mission has under 'information'"
    )
    parser.add_argument("--port", type=int, default=PORT, help=f"what 'fly --control' was given [default: {PORT}]")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Say it."""
    from deploy.cli.console import fail
    from deploy.control import tell, tell_map

    if (args.word == "map") != (args.file is not None):
        return fail("a map needs --file MAP, and only a map does")
    print(tell(args.port, args.word) if args.file is None else tell_map(args.port, _one_line(args.file)))
    return 0


def _one_line(path: Path) -> str:
    """A map's YAML as JSON in one line. Raises MissionError."""
    from missions.files import read_text
    from missions.replanning import one_line

    return one_line(read_text(path), file=str(path))
