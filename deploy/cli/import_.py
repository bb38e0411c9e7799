"""``ergoflie import``: what others planned, or set up, becomes a certified plan or a mission."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from deploy.cli.types import Subparsers
    from planner.flightplan import FlightPlan

Parsed = TypeVar("Parsed")


def add_parser(commands: Subparsers) -> None:
    """Add this command and what it imports."""
    parser = commands.add_parser("import", help="trajectories, waypoints or a Crazyswarm2 set-up of others")
    kinds = parser.add_subparsers(title="what to import", metavar="KIND", required=True)
    _add_trajectories(kinds)
    _add_waypoints(kinds)
    _add_crazyswarm2(kinds)


def _add_trajectories(kinds: Subparsers) -> None:
    parser = kinds.add_parser(
        "trajectories", help="uav_trajectories CSV files, one a robot, become a certified plan as they are"
    )
    _add_plan_arguments(parser)
    parser.set_defaults(run=_run_trajectories)


def _add_waypoints(kinds: Subparsers) -> None:
    parser = kinds.add_parser(
        "waypoints", help="waypoint CSV files (x,y,z or t,x,y,z[,yaw]), one a robot, become a certified plan"
    )
    _add_plan_arguments(parser)
    parser.add_argument(
        "--max-speed", type=float, metavar="M/S", help="where times are chosen [default: the mission's limit]"
    )
    parser.add_argument(
        "--max-acceleration", type=float, metavar="M/S2", help="where times are chosen [default: the mission's limit]"
    )
    parser.set_defaults(run=_run_waypoints)


def _add_crazyswarm2(kinds: Subparsers) -> None:
    parser = kinds.add_parser("crazyswarm2", help="the enabled robots of a crazyflies.yaml become a new mission file")
    parser.add_argument("crazyflies", type=Path, metavar="CRAZYFLIES.yaml", help="robots, types and parameters")
    parser.add_argument("--motion-capture", type=Path, metavar="FILE", help="motion_capture.yaml: system and host")
    parser.add_argument("-o", "--output", type=Path, required=True, help="mission file to write; must not exist")
    parser.set_defaults(run=_run_crazyswarm2)


def _add_plan_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("mission", type=Path, help="mission file (YAML): robots, starts, horizon, limits")
    parser.add_argument("source", type=Path, nargs="+", metavar="DIR-or-FILE", help="a folder of <robot>.csv, or files")
    parser.add_argument("-o", "--output", type=Path, required=True, help="plan file to write")
    parser.add_argument("--json", action="store_true", help="print figures as JSON")


def _run_trajectories(args: argparse.Namespace) -> int:
    """Polynomials as they are: encode, certify, write."""
    from missions.loader import load_mission
    from planner.interchange.polynomials import flight_plan_of
    from planner.trajectory.csv import from_csv

    mission = load_mission(args.mission)
    trajectories = _read(args.source, from_csv)
    return _deliver(args, lambda: flight_plan_of(mission, trajectories))


def _run_waypoints(args: argparse.Namespace) -> int:
    """Least snap through waypoints: plan, encode, certify, write."""
    from missions.loader import load_mission
    from planner.interchange.through import flight_through
    from planner.interchange.waypoints import parse_waypoints

    mission = load_mission(args.mission)
    waypoints = _read(args.source, parse_waypoints)
    return _deliver(
        args, lambda: flight_through(mission, waypoints, speed=args.max_speed, acceleration=args.max_acceleration)
    )


def _run_crazyswarm2(args: argparse.Namespace) -> int:
    """Robots of a set-up: read, write a mission, say what was left behind."""
    from deploy.cli.console import err, fail
    from deploy.cli.planning import print_done
    from deploy.files import write_whole
    from missions.files import read_text
    from missions.interchange.crazyflies import parse_crazyflies
    from missions.interchange.motion_capture import parse_motion_capture
    from missions.interchange.swarm_mission import swarm_mission

    swarm = parse_crazyflies(read_text(args.crazyflies), str(args.crazyflies))
    path: Path | None = args.motion_capture
    capture = parse_motion_capture(read_text(path), str(path)) if path else None
    target: Path = args.output
    name = re.sub("[^A-Za-z0-9_-]", "_", target.stem).lstrip("-")[:64] or "mission"
    text, notes = swarm_mission(swarm, capture, name=name, file=args.crazyflies.name)
    try:
        write_whole(target, text.encode(), replace=False)
    except FileExistsError:
        return fail(f"{target}: exists; allowed: a new file, for missions are written by hand")
    for note in notes:
        err.print(f"not taken over: {note}", markup=False, soft_wrap=True)
    print_done(f"mission: {target}")
    return 0


def _deliver(args: argparse.Namespace, make: Callable[[], FlightPlan]) -> int:
    """Make a plan, write it, print what it promises; print why if it is not certified."""
    from deploy.cli.certificate import print_certificate
    from deploy.cli.console import err, print_json
    from deploy.cli.planning import print_done, print_plan, summary
    from deploy.planfile import write_plan
    from planner.errors import CertificateFailed

    try:
        flight_plan = make()
    except CertificateFailed as failure:
        print_certificate(failure.certificate, only_failed=True)
        err.print(f"ergoflie: {args.mission}: {failure}", markup=False, soft_wrap=True)
        return 1
    write_plan(args.output, flight_plan)
    if args.json:
        print_json({**summary(flight_plan), "plan": str(args.output)})
    else:
        print_plan(flight_plan)
        print_done(f"plan: {args.output}")
    return 0


def _read(sources: list[Path], parse: Callable[[str, str], Parsed]) -> Mapping[str, Parsed]:
    """Every robot's file, by robot name: the file's name without ``.csv``."""
    from missions.errors import MissionError
    from missions.files import read_text

    found: dict[str, Parsed] = {}
    for source in sources:
        paths = sorted(source.glob("*.csv")) if source.is_dir() else [source]
        if not paths:
            raise MissionError("no CSV files; allowed: one <robot>.csv a robot", file=str(source))
        for path in paths:
            if path.stem in found:
                raise MissionError(f"a second file for robot {path.stem}; allowed: one", file=str(path))
            found[path.stem] = parse(read_text(path), str(path))
    return found
