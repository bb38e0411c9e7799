"""A flight as the command line shows it: one live line, Ctrl-C as the operator."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING

from rich.markup import escape
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from deploy.cli.console import err, out, table

if TYPE_CHECKING:
    from deploy.flight.records import FlightOutcome, FlightStatus
    from deploy.operator import Operator
    from deploy.preflight import PreflightCheck
    from deploy.scenario.killed import HostDied

HINT = "Ctrl-C lands everybody; twice stops the motors"
KEYS_HINT = "keys: l land, h hold, a abort to the pads, X stop the motors; Ctrl-C lands, twice stops"


@contextmanager
def watched(control: int | None = None) -> Iterator[tuple[Operator, Callable[[FlightStatus], None]]]:
    """While inside, the terminal shows the flight; Ctrl-C, keys and a socket are the operator's voice.

    Args:
        control: port of this computer to listen at; None: no socket.

    Raises:
        DeployError: the port is taken.
    """
    from deploy.cli.keys import keys
    from deploy.control import listening
    from deploy.operator import interrupts

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description:<14}"),
        BarColumn(bar_width=24),
        TextColumn("{task.fields[state]}", markup=False),
        TimeElapsedColumn(),
    )
    with (
        interrupts() as operator,
        nullcontext() if control is None else listening(control, operator),
        Progress(*columns, console=err, transient=True) as bar,
        keys(operator.say) as keyboard,
    ):
        task = bar.add_task("connecting", total=None, state=KEYS_HINT if keyboard else HINT)

        def observe(status: FlightStatus) -> None:
            searching = math.isfinite(status.mission_time)
            bar.update(
                task,
                description=status.phase.value,
                total=status.duration if searching else None,
                completed=max(status.mission_time, 0.0) if searching else 0.0,
                state=_state(status),
            )

        yield operator, observe


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


def _state(status: FlightStatus) -> str:
    """The worst of every figure over the swarm, in one line."""

    def worst(values: list[float], pick: Callable[[list[float]], float]) -> float:
        known = [value for value in values if math.isfinite(value)]
        return pick(known) if known else math.nan

    error = worst([robot.error for robot in status.robots], max)
    volts = worst([robot.voltage for robot in status.robots], min)
    latency = worst([robot.latency for robot in status.robots], max)
    parts = [f"t {status.t:5.1f} s"]
    parts += [f"error {error * 100:.1f} cm"] if math.isfinite(error) else []
    parts += [f"battery {volts:.2f} V"] if math.isfinite(volts) else []
    parts += [f"link {latency:.0f} ms"] if math.isfinite(latency) else []
    parts += [f"{robot.name}: {robot.note}" for robot in status.robots if robot.note]
    return "  ".join(parts)
