"""A flight as the command line shows it, with Ctrl-C as the operator."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from rich.markup import escape

from deploy.cli.console import err, out, table

if TYPE_CHECKING:
    import argparse

    from deploy.errors import DeployError
    from deploy.flight.records import FlightOutcome, FlightStatus
    from deploy.preflight import PreflightCheck
    from deploy.scenario.killed import HostDied
    from deploy.watch import Watch
    from planner.flightplan import FlightPlan

HINT = "Ctrl-C lands everybody; twice stops the motors"
KEYS_HINT = "keys: l land, h hold, a abort to the pads, X stop the motors; Ctrl-C lands, twice stops"


@contextmanager
def watched(flight_plan: FlightPlan, *, control: int | None = None, live: int | None = None) -> Iterator[Watch]:
    """While inside, the terminal shows the flight; Ctrl-C, keys and a socket are the operator's voice.

    Args:
        flight_plan: what flies.
        control: port of this computer to listen at; None: no socket.
        live: port of this computer to show the flight at; None: nowhere but on the terminal.

    Raises:
        DeployError: a port is taken.
    """
    from deploy.cli.dashboard import dashboard
    from deploy.cli.keys import keys
    from deploy.control import listening
    from deploy.live import live as serving
    from deploy.operator import interrupts
    from deploy.watch import Watch

    with ExitStack() as inside:
        operator = inside.enter_context(interrupts())
        if control is not None:
            inside.enter_context(listening(control, operator))
        page = None if live is None else inside.enter_context(serving(flight_plan, live))
        hint = KEYS_HINT if inside.enter_context(keys(operator.say)) else HINT
        if page is not None:
            err.print(f"live: {page.url}", markup=False, soft_wrap=True)
        board = inside.enter_context(dashboard(err, hint))

        def observe(status: FlightStatus) -> None:
            board(status)
            if page is not None:
                page.frames.show(status)

        yield Watch(operator, observe, page.topics.record if page is not None else None, operator.new_map)


def live_port(parser: argparse.ArgumentParser) -> None:
    """Add ``--live [PORT]``."""
    parser.add_argument(
        "--live",
        type=int,
        nargs="?",
        const=8765,
        metavar="PORT",
        help="show the flight in a browser and in Foxglove, at this port of this computer only [port: 8765]",
    )


def print_preflight(checks: Sequence[PreflightCheck]) -> int:
    """Every check with what was found and what is allowed; returns the exit code: 1 if one fails."""
    marks = {"pass": "[green]✓[/]", "warning": "[yellow]![/]", "failure": "[red]✗[/]"}
    rows = [
        (marks[c.result], *(escape(cell) for cell in (c.robot, c.name, c.value, c.limit, c.remedy))) for c in checks
    ]
    table("pre-flight checks", ("", "robot", "check", "found", "allowed", "remedy"), rows)
    failed = sum(check.result == "failure" for check in checks)
    out.print(f"{failed} of {len(checks)} checks failed" if failed else f"all {len(checks)} checks passed")
    return int(failed > 0)


def print_called_off(error: DeployError) -> int:
    """Why nobody took off; returns the exit code."""
    from deploy.errors import PreflightError

    if isinstance(error, PreflightError):
        return print_preflight(error.checks)
    err.print(f"nobody took off: {error}", markup=False)
    return 1


def print_outcome(outcome: FlightOutcome) -> None:
    """How prompt a flight was, how it ended early, or what it complained of."""
    delays = [f"starts within {outcome.start_skew * 1000:.1f} ms"] * math.isfinite(outcome.start_skew)
    if outcome.latencies:
        medians = [latency.median for latency in outcome.latencies.values()]
        slowest = max(latency.largest for latency in outcome.latencies.values())
        delays.append(f"commands answered within {max(medians) * 1000:.1f} ms (median), {slowest * 1000:.1f} ms (most)")
    delays += [f"reaction within {outcome.reaction * 1000:.0f} ms"] * math.isfinite(outcome.reaction)
    if delays:
        err.print("; ".join(delays), markup=False)
    if outcome.reason:
        err.print(f"flight {outcome.phase.value}: {outcome.reason}", markup=False)
    for name, why in outcome.left_behind.items():
        err.print(f"  {name} did not fly: {why}", markup=False)
    for line in (*outcome.faults, *outcome.warnings):
        err.print(f"  {line}", markup=False)


def print_death(dead: HostDied) -> None:
    """What became of the drones whose host's process was killed."""
    err.print(f"the host's process was killed at {dead.t:.2f} s; nobody talked to the drones any more:", markup=False)
    for line in dead.after:
        err.print(f"  {line}", markup=False)
