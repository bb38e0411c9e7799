"""The flight on the terminal: drones × state, battery, link, error; E so far. Plain lines where it is no terminal."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from deploy.cli.console import number
from deploy.flight.records import FlightStatus, RobotStatus
from deploy.phases import Phase

MESSAGES = 6  # newest events below the table
REFRESH = 4.0  # Hz
LINES_EVERY = 10.0  # s of flight between two plain lines of figures
# Where a figure turns yellow, and red: battery [V] falling, link [ms] and error [m] rising.
VOLTS, LATENCY, ERROR = (3.5, 3.2), (60.0, 200.0), (0.1, 0.25)
_PHASE_STYLES = {Phase.ABORTING: "bold red", Phase.ABORTED: "bold red", Phase.EMERGENCY: "bold white on red"}
_WRONG = ("tumbled", "locked", "crashed", "deck fault")


class Dashboard:
    """What a person flies by.

    Args:
        hint: how to end the flight, always in sight.
    """

    def __init__(self, hint: str) -> None:
        self._hint = hint
        self._said: deque[tuple[float, str]] = deque(maxlen=MESSAGES)

    def note(self, status: FlightStatus) -> bool:
        """Remember what was said; whether it is new."""
        new = bool(status.message) and (not self._said or self._said[-1][1] != status.message)
        if new:
            self._said.append((status.t, status.message))
        return new

    def view(self, status: FlightStatus | None) -> RenderableType:
        """The whole picture."""
        if status is None:
            return Text(f"connecting …   {self._hint}", style="dim")
        parts: list[RenderableType] = [_head(status), _robots(status)]
        parts += [Text(f"{robot.name}: {robot.note}", style="bold red") for robot in status.robots if robot.note]
        parts += [Text(f"{t:7.1f} s  {text}", style="dim", no_wrap=True, overflow="ellipsis") for t, text in self._said]
        return Group(*parts, Text(self._hint, style="bold"))


@contextmanager
def dashboard(console: Console, hint: str) -> Iterator[Callable[[FlightStatus], None]]:
    """While inside, the console shows the flight; yields its observer, which only remembers what it is told."""
    board = Dashboard(hint)
    if not console.is_terminal:
        yield _plain(console, board)
        return
    newest: FlightStatus | None = None

    def observe(status: FlightStatus) -> None:
        nonlocal newest
        newest = status
        board.note(status)

    # Drawn by a thread of rich's own: a slow terminal must not hold up the flight.
    with Live(get_renderable=lambda: board.view(newest), console=console, refresh_per_second=REFRESH, transient=True):
        yield observe


def _plain(console: Console, board: Dashboard) -> Callable[[FlightStatus], None]:
    """Lines for a log or a pipe: what happens, and the worst of every figure now and then."""
    due, phase = 0.0, None

    def observe(status: FlightStatus) -> None:
        nonlocal due, phase
        if board.note(status) or status.phase is not phase:
            words = _words(status.phase)
            said = f": {status.message}" if status.message not in ("", words, status.phase.value) else ""
            console.print(f"{status.t:7.1f} s  {words}{said}", markup=False, soft_wrap=True)
            phase = status.phase
        figures = worst(status)
        if figures and status.t >= due:
            due = status.t + LINES_EVERY
            console.print(f"{status.t:7.1f} s  {figures}", markup=False, soft_wrap=True)

    return observe


def worst(status: FlightStatus) -> str:
    """The worst of every figure over the swarm, in one line."""
    robots = status.robots
    parts: list[tuple[Callable[[list[float]], float], list[float], Callable[[float], str]]] = [
        (max, [robot.error for robot in robots], lambda v: f"error {v * 100:.1f} cm"),
        (min, [robot.voltage for robot in robots], lambda v: f"battery {v:.2f} V"),
        (max, [robot.latency for robot in robots], lambda v: f"link {v:.0f} ms"),
        (max, [status.ergodicity], lambda v: f"E {number(v)}"),
    ]
    figures = []
    for pick, values, word in parts:
        known = [value for value in values if math.isfinite(value)]
        figures += [word(pick(known))] if known else []
    return ", ".join([*figures, *(f"{robot.name}: {robot.note}" for robot in robots if robot.note)])


def _head(status: FlightStatus) -> RenderableType:
    searching = math.isfinite(status.mission_time)
    done = min(max(status.mission_time, 0.0), status.duration) if searching else 0.0
    row = Table.grid(padding=(0, 2))
    title = Text(_words(status.phase), style=_PHASE_STYLES.get(status.phase, "bold"))
    clock = f"{done:.1f} of {status.duration:.0f} s" if searching else f"t {status.t:.1f} s"
    E = f"E {number(status.ergodicity)} of {number(status.certified)}" if math.isfinite(status.ergodicity) else ""
    row.add_row(title, ProgressBar(total=status.duration, completed=done, width=20), Text(clock), Text(E))
    return row


def _robots(status: FlightStatus) -> Table:
    table = Table(header_style="bold", pad_edge=False, box=SIMPLE_HEAD)
    table.add_column("robot", no_wrap=True)
    table.add_column("state", no_wrap=True)
    for heading in ("position [m]", "battery [V]", "link [ms]", "error [cm]"):
        table.add_column(Text(heading), justify="right", no_wrap=True)
    for robot in status.robots:
        table.add_row(robot.name, _state(robot), *_figures(robot))
    return table


def _state(robot: RobotStatus) -> Text:
    wrong = any(word in robot.state for word in _WRONG)
    return Text(robot.state or "–", style="bold red" if wrong else "green" if robot.state == "flying" else "")


def _figures(robot: RobotStatus) -> tuple[Text, ...]:
    place = Text("–") if robot.position is None else Text(" ".join(f"{value:5.2f}" for value in robot.position))
    level = f" {robot.level:3.0f} %" if math.isfinite(robot.level) else ""
    return (
        place,
        _graded(robot.voltage, f"{robot.voltage:.2f}{level}", VOLTS, falling=True),
        _graded(robot.latency, f"{robot.latency:.0f}", LATENCY),
        _graded(robot.error, f"{robot.error * 100:.1f}", ERROR),
    )


def _graded(value: float, text: str, limits: tuple[float, float], *, falling: bool = False) -> Text:
    """A figure in the colour of how bad it is."""
    if not math.isfinite(value):
        return Text("–")
    passed = sum(value <= limit if falling else value >= limit for limit in limits)
    return Text(text, style=("", "yellow", "bold red")[passed])


def _words(phase: Phase) -> str:
    return phase.value.replace("_", " ")
