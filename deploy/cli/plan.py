"""``ergoflie plan``: mission file → certified plan file."""

from __future__ import annotations

import argparse
import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from deploy.cli.types import Subparsers


def add_parser(commands: Subparsers) -> None:
    """Add this command."""
    parser = commands.add_parser("plan", help="solve a mission, fit polynomials, certify the bytes that will fly")
    parser.add_argument("mission", type=Path, help="mission file (YAML), or with --pick a front that 'pareto' wrote")
    parser.add_argument("-o", "--output", type=Path, help="plan file to write [default: <mission>.plan.mcap]")
    parser.add_argument(
        "--pick", metavar="PLAN", help="the front's plan of this index or name, as it is if it certifies"
    )
    parser.add_argument("--seed", type=int, help="overrides the mission's solver.seed")
    parser.add_argument("--json", action="store_true", help="print figures as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Plan, write the plan file, print what it promises."""
    from deploy.cli.console import fail, out, print_json
    from deploy.cli.planning import plan_mission, plan_pick, print_plan, summary
    from deploy.planfile import write_plan

    mission_path: Path = args.mission
    if args.pick is not None and args.seed is not None:
        return fail("--seed: a plan that is picked is not searched for again; leave one of --pick and --seed out")
    if args.pick is None:
        name, search = mission_path.stem, partial(plan_mission, mission_path, seed=args.seed)
    else:
        front = mission_path.name.removesuffix(".json").removesuffix(".front")
        name, search = f"{front}.{_in_name(args.pick)}", partial(plan_pick, mission_path, args.pick)
    target: Path = args.output or Path(f"{name}.plan.mcap")
    if obstacle := _obstacle(target):
        return fail(f"{target}: cannot write the plan file: {obstacle}")
    flight_plan = search()
    if flight_plan is None:
        return 1
    target.parent.mkdir(parents=True, exist_ok=True)
    write_plan(target, flight_plan)
    if args.json:
        print_json({**summary(flight_plan), "plan": str(target)})
    else:
        print_plan(flight_plan)
        out.print(f"plan: {target}")
    return 0


def _obstacle(target: Path) -> str:
    """Why a file could not be written, as far as that can be told before planning takes time; empty if it could."""
    if target.is_dir():
        return "it is a folder"
    folder = next(parent for parent in target.absolute().parents if parent.exists())
    if not folder.is_dir():
        return f"{folder} is no folder"
    return "" if os.access(folder, os.W_OK) else f"no permission to write into {folder}"


def _in_name(pick: str) -> str:
    """What was picked, in a file's name."""
    return "".join(character if character.isalnum() or character in "-_" else "_" for character in pick)[:64]
