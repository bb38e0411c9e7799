"""``ergoflie sim``: a mission's drones on UDP ports in real time, for any other client."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table

    from deploy.cli.types import Subparsers
    from deploy.served import Served

_JSON_PERIOD = 0.1  # [s]
_PORT = 19850  # deploy.radio.simulated.server.FIRST_PORT, without importing cflib for --help


def add_parser(commands: Subparsers) -> None:
    """Add this command."""
    parser = commands.add_parser(
        "sim", help="serve a mission's drones over UDP in real time, for cflib, cfclient and other clients"
    )
    parser.add_argument("mission", metavar="MISSION", type=Path, help="mission file (.yaml): robots and their pads")
    parser.add_argument(
        "--port", type=int, default=_PORT, help=f"UDP port of the first drone, 0: any free ones [default: {_PORT}]"
    )
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        help="interface to listen on; whoever reaches it can fly the drones [default: 127.0.0.1]",
    )
    parser.add_argument(
        "--pose",
        choices=["onboard", "mocap", "none"],
        default="onboard",
        help="what tells the drones where they are: a deck like Lighthouse, motion capture that sends poses, or "
        "only the clients (without them they drift) [default: onboard]",
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of the simulation [default: 0]")
    parser.add_argument(
        "--duration", metavar="SECONDS", type=_seconds, help="end by itself after this long [default: until Ctrl-C]"
    )
    parser.add_argument(
        "--json",
        action="store_true",
        help="instead of the table, ten times a second one line of JSON on standard output: where everybody really is",
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Serve until Ctrl-C."""
    from deploy.cli.console import fail
    from deploy.clock import SystemClock
    from deploy.served import Served
    from missions.loader import load_mission

    if not 0 <= args.port <= 65535:
        return fail(f"--port: got {args.port}; allowed: 0 (any) to 65535")
    mission = load_mission(args.mission)
    clock = SystemClock()
    end = math.inf if args.duration is None else args.duration
    try:
        with Served(mission, clock, host=args.host, port=args.port, positioning=args.pose, seed=args.seed) as served:
            if args.json:
                served.run(lambda: clock.now() >= end, _print_json, _JSON_PERIOD)
                return 0
            for name, uri in served.uris.items():
                print(f"{name} {uri}", flush=True)
            with _shown() as show:
                served.run(lambda: clock.now() >= end, show)
    except KeyboardInterrupt:
        pass  # the way to end it
    return 0


def _print_json(served: Served) -> None:
    """One line: the drones' time, what was lost of it, and every drone as somebody in the room sees it."""
    drones = [drone._asdict() for drone in served.status()]
    print(json.dumps({"t": served.t, "lost": served.lost, "drones": drones}), flush=True)


@contextmanager
def _shown() -> Iterator[Callable[[Served], None] | None]:
    """While inside, a table on the terminal follows the drones; nothing if nobody looks."""
    from deploy.cli.console import err

    if not err.is_terminal:
        yield None
        return
    from rich.live import Live

    with Live(console=err, auto_refresh=False, transient=True) as live:
        yield lambda served: live.update(_table(served), refresh=True)


def _table(served: Served) -> Table:
    from rich.table import Table

    lost = f", {served.lost:.1f} s lost: this computer is too slow" if served.lost > 0.0 else ""
    table = Table(box=None, title=f"t {served.t:.1f} s{lost}; Ctrl-C ends", title_justify="left", title_style="")
    for heading in ("drone", "address", "client", "state", "battery", "x", "y", "z [m]"):
        table.add_column(heading, justify="right" if heading in ("battery", "x", "y", "z [m]") else "left")
    for drone in served.status():
        client = "connected" if drone.connected else "–"
        place = [f"{value:.2f}" for value in drone.position]
        table.add_row(drone.name, drone.uri, client, drone.state, f"{drone.voltage:.2f} V", *place)
    return table


def _seconds(text: str) -> float:
    """A positive number of seconds."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"got '{text}'; allowed: a positive number of seconds")
    return value
