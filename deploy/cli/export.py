"""``ergoflie export``: what will fly, decoded from the bytes, as uav_trajectories CSV files."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from deploy.cli.types import Subparsers


def add_parser(commands: Subparsers) -> None:
    """Add this command."""
    parser = commands.add_parser(
        "export", help="write one uav_trajectories CSV a robot, decoded from the bytes that fly"
    )
    parser.add_argument("plan", type=Path, help="plan file")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for <robot>.csv")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Decode every robot's bytes and write its CSV file."""
    from deploy.cli.planning import print_done
    from deploy.planfile import read_plan
    from planner.trajectory.csv import to_csv
    from planner.trajectory.encode import decode

    flight_plan = read_plan(args.plan)
    texts = {name: to_csv(decode(encoded)) for name, encoded in flight_plan.trajectories.items()}
    args.output.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        path = args.output / f"{name}.csv"
        path.write_text(text, encoding="ascii")
        print_done(str(path))
    return 0
