"""``ergoflie fly``: the flight on hardware."""

from __future__ import annotations

import argparse
import datetime
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from deploy.cli.flying import live_port

if TYPE_CHECKING:
    from deploy.cli.types import Subparsers
    from deploy.clock import SystemClock
    from missions.schema import Mission
    from mocap.source import MocapSource
    from planner.flightplan import FlightPlan


def add_parser(commands: Subparsers) -> None:
    """Add this command."""
    parser = commands.add_parser("fly", help="fly a certified plan on hardware (Crazyradio)")
    parser.add_argument("plan", type=Path, help="plan file")
    parser.add_argument(
        "-o", "--output", type=Path, default=Path("logs"), help="folder for log and report [default: logs]"
    )
    parser.add_argument(
        "--mocap",
        metavar="SYSTEM",
        help="vicon, optitrack, qualisys, vrpn, or Crazyswarm2's motion_capture.yaml [default: on-board positioning]",
    )
    parser.add_argument("--mocap-host", metavar="HOST", default="", help="address of the motion-capture server")
    parser.add_argument(
        "--check-only", action="store_true", help="make every pre-flight check, list them, and fly nothing"
    )
    parser.add_argument(
        "--control", type=int, metavar="PORT", help="port of this computer for 'ergoflie control' [default: none]"
    )
    live_port(parser)
    parser.add_argument("--yes", action="store_true", help="do not ask before take-off")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Check plan and radio, ask, fly, report."""
    from deploy.cli.console import fail
    from deploy.cli.flying import print_called_off, print_outcome, print_preflight, watched
    from deploy.cli.planning import print_plan
    from deploy.cli.replanning import beside
    from deploy.cli.reporting import print_analysis, write_report
    from deploy.errors import FlightAborted, PreflightError
    from deploy.flightlog.reader import read_log
    from deploy.hardware import check_hardware, fly_hardware, prepare_links
    from deploy.planfile import read_plan
    from deploy.radio.fleet import FleetError

    flight_plan = read_plan(args.plan)
    prepare_links(flight_plan.mission)
    mocap = _mocap(args.mocap, args.mocap_host, flight_plan.mission)
    print_plan(flight_plan)
    if not (args.yes or args.check_only) and not _confirmed(flight_plan, args.mocap):
        return fail("not flown: nobody confirmed", code=1)
    args.output.mkdir(parents=True, exist_ok=True)
    stamp = datetime.datetime.now(datetime.UTC).strftime("%Y%m%dT%H%M%SZ")
    log_path = args.output / f"{stamp}_{flight_plan.mission.name}.mcap"
    if args.check_only:
        with watched(flight_plan, live=args.live) as watch:
            report, _ = check_hardware(flight_plan, log_path=log_path, mocap=mocap, watch=watch)
        return print_preflight(report.checks)
    try:
        with (
            beside(flight_plan.mission) as replanner,
            watched(flight_plan, control=args.control, live=args.live) as watch,
        ):
            outcome, log_path = fly_hardware(
                flight_plan, log_path=log_path, mocap=mocap, watch=watch, replanner=replanner
            )
    except (FlightAborted, FleetError, PreflightError) as error:
        return print_called_off(error)
    print_outcome(outcome)
    target = log_path.with_suffix(".html")
    return print_analysis(write_report(read_log(log_path), target), target, as_json=False)


def _confirmed(flight_plan: FlightPlan, mocap: str | None) -> bool:
    """Whether the person at the terminal typed the word."""
    if not sys.stdin.isatty():
        return False
    names = ", ".join(robot.name for robot in flight_plan.mission.robots)
    print(f"about to fly {names}; positioning: {mocap or 'on board'}; is the room clear?")
    return input("type 'fly' to take off: ").strip() == "fly"


def _mocap(named: str | None, host: str, mission: Mission) -> Callable[[SystemClock], MocapSource | None]:
    """How to make the motion capture once the flight's clock exists.

    Raises:
        MocapUnavailable: nothing talks to this system in the mission's way. MissionError: not a motion_capture.yaml.
    """
    if named is None:
        return lambda clock: None
    from missions.files import read_text
    from missions.interchange.motion_capture import parse_motion_capture
    from mocap.setup import open_system
    from mocap.systems import library_for

    system = named
    if Path(named).suffix in {".yaml", ".yml"}:
        capture = parse_motion_capture(read_text(Path(named)), named)
        system, host = capture.system, host or capture.hostname
    library_for(system, mission.motion_capture.tracking)  # said before anybody is asked to clear the room
    return lambda clock: open_system(system, host, mission, clock.now)
