"""``ergoflie dry-run``: the whole flight on simulated drones over the simulated radio."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from deploy.cli.flying import live_port

if TYPE_CHECKING:
    from deploy.cli.types import Subparsers


def add_parser(commands: Subparsers) -> None:
    """Add this command."""
    parser = commands.add_parser(
        "dry-run", help="rehearse a mission or a plan on simulated drones; log, report, verdict"
    )
    parser.add_argument(
        "source", metavar="MISSION-or-PLAN", type=Path, help="mission file (.yaml) or plan file (.mcap)"
    )
    parser.add_argument("-o", "--output", type=Path, help="folder for plan, log and report [default: out/<name>]")
    parser.add_argument(
        "--speed",
        type=_speed,
        help="times real time, or 'max' [default: max; 1 with --live, so that it can be watched]",
    )
    parser.add_argument("--seed", type=int, help="seed of the simulation [default: the scenario's, else 0]")
    parser.add_argument(
        "--scenario", metavar="FAULTS", type=Path, help="what goes wrong, when and with whom (.yaml; see README)"
    )
    parser.add_argument(
        "--control",
        metavar="PORT",
        type=int,
        help="hear 'ergoflie control' at this port of this computer; words come in wall time: best with --speed 1",
    )
    live_port(parser)
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Plan if need be, rehearse, report."""
    from deploy.cli.flying import print_called_off, print_death, print_outcome, watched
    from deploy.cli.planning import plan_mission, print_plan
    from deploy.cli.replanning import rehearsed
    from deploy.cli.reporting import print_analysis, write_report
    from deploy.errors import FlightAborted, PreflightError
    from deploy.flightlog.reader import read_log
    from deploy.planfile import read_plan, write_plan
    from deploy.radio.fleet import FleetError
    from deploy.rehearsal import rehearse
    from deploy.scenario.killed import HostDied
    from deploy.scenario.load import load_scenario
    from missions.loader import load_mission

    planned = args.source.suffix not in {".yaml", ".yml"}
    flight_plan = read_plan(args.source) if planned else None
    mission = load_mission(args.source) if flight_plan is None else flight_plan.mission
    scenario = None if args.scenario is None else load_scenario(args.scenario, mission)  # before planning takes time
    flight_plan = flight_plan or plan_mission(args.source)
    if flight_plan is None:
        return 1
    seed = args.seed if args.seed is not None else (scenario.seed if scenario else None) or 0
    folder: Path = args.output or Path("out") / flight_plan.mission.name
    folder.mkdir(parents=True, exist_ok=True)
    if not planned:
        write_plan(folder / "plan.mcap", flight_plan)
    if not args.json:
        print_plan(flight_plan)
    log_path = folder / "flight.mcap"
    part = log_path.with_name(log_path.name + ".part")
    for old in (log_path, part):
        old.unlink(missing_ok=True)  # a rehearsal is repeatable: the last one replaces the one before
    dead: HostDied | None = None
    called_off: FlightAborted | FleetError | PreflightError | None = None
    speed = args.speed if args.speed is not None else math.inf if args.live is None else 1.0
    with watched(flight_plan, control=args.control, live=args.live) as watch:
        try:
            outcome, log_path = rehearse(
                flight_plan,
                log_path=log_path,
                seed=seed,
                speed=speed if math.isfinite(speed) else None,
                operator=watch.operator,
                observer=watch.observer,
                tap=watch.tap,
                scenario=scenario,
                replanner=rehearsed() if flight_plan.mission.replanning.joints else None,
                new_map=watch.new_map,
            )
        except HostDied as error:
            dead, log_path = error, part
        except (FlightAborted, FleetError, PreflightError) as error:
            called_off = error
    if called_off is not None:
        return print_called_off(called_off)
    if dead is None:
        print_outcome(outcome)
    else:
        print_death(dead)
    target = folder / "report.html"
    analysis = write_report(read_log(log_path), target)
    return max(print_analysis(analysis, target, as_json=args.json), int(dead is not None))


def _speed(text: str) -> float:
    """A positive number; 'max' is infinite."""
    if text == "max":
        return math.inf
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not value > 0:
        raise argparse.ArgumentTypeError(f"got '{text}'; allowed: a positive number, or 'max'")
    return value
