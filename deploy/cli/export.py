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
    parser.add_argument(
        "--crazyswarm2", action="store_true", help="also write crazyflies.yaml for the mission's robots"
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Decode every robot's bytes and write its CSV file."""
    from deploy.cli.planning import print_done
    from deploy.files import write_whole
    from deploy.planfile import read_plan
    from missions.interchange.to_crazyflies import crazyflies_yaml
    from planner.trajectory.csv import to_csv
    from planner.trajectory.encode import decode

    flight_plan = read_plan(args.plan)
    texts = {f"{name}.csv": to_csv(decode(encoded)) for name, encoded in flight_plan.trajectories.items()}
    if args.crazyswarm2:
        texts["crazyflies.yaml"] = crazyflies_yaml(flight_plan.mission)
    args.output.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        write_whole(args.output / name, text.encode())
        print_done(str(args.output / name))
    return 0
