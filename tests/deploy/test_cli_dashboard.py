"""What a person flies by: every figure of every drone, on a terminal and without one."""

import io
import math

import pytest
from rich.console import Console

from deploy.cli.dashboard import Dashboard, dashboard
from deploy.flight.records import FlightStatus, RobotStatus
from deploy.phases import Phase

GOOD = RobotStatus("cf1", (1.0, 2.0, 0.6), 0.031, 3.91, 6.4, state="flying", level=71.0)
BAD = RobotStatus("cf2", None, 0.4, 3.1, 250.0, note="off its way [bold]", state="crashed")
LOST = RobotStatus("cf3", None, math.nan, math.nan, math.nan)


def status(t=12.0, phase=Phase.ON_MISSION, message="cf2: off its way [bold]", **more):
    known = {"mission_time": 5.0, "duration": 30.0, "ergodicity": 0.0123, "certified": 2.5e-4, **more}
    return FlightStatus(t, phase, known.pop("mission_time"), known.pop("duration"), (GOOD, BAD, LOST), message, **known)


def test_every_figure_is_there_and_what_is_wrong_is_red():
    board = Dashboard("Ctrl-C lands")
    board.note(status())
    console = Console(file=io.StringIO(), width=120, record=True)
    console.print(board.view(status()))
    text = console.export_text(clear=False)
    for cell in (
        "on mission",
        "5.0 of 30 s",
        "E 0.0123 of 2.5e-4",
        "cf1",
        "flying",
        "3.91  71 %",
        "3.1",
        "crashed",
    ):
        assert cell in text
    for cell in (
        "1.00  2.00  0.60",
        "40.0",
        "250",
        "position [m]",
        "cf2: off its way [bold]",
        "12.0 s",
        "Ctrl-C lands",
    ):
        assert cell in text
    row = next(line for line in text.splitlines() if "cf3" in line)
    assert row.count("–") == 5  # nothing is known of it
    red = console.export_html(inline_styles=True)
    assert "color: #800000" in red[red.index("crashed") - 120 : red.index("crashed")]
    assert "color: #008000" in red[red.index("flying") - 120 : red.index("flying")]


@pytest.mark.parametrize("width", [60, 80, 200])
def test_it_fits_the_terminal(width):
    board = Dashboard("Ctrl-C lands")
    for t in range(30):
        board.note(status(float(t), message=f"event {t} " + "long " * 60))
    console = Console(file=io.StringIO(), width=width, record=True)
    console.print(board.view(status()))
    lines = console.export_text().splitlines()
    assert max(map(len, lines)) <= width
    assert len(lines) < 24
    assert any("cf2: off its way [bold]" in line for line in lines)  # where there is little room, too
    console.print(board.view(None))


def test_a_terminal_is_drawn_by_another_thread():
    out = io.StringIO()
    console = Console(file=out, force_terminal=True, width=100)
    with dashboard(console, "keys: l land") as observe:
        observe(status())
    assert "cf2" in out.getvalue()


def test_without_a_terminal_there_are_lines():
    out = io.StringIO()
    with dashboard(Console(file=out, width=40), "hint") as observe:
        observe(status(0.0, Phase.IDLE, "", mission_time=math.nan, ergodicity=math.nan))
        for k in range(150):
            observe(status(0.1 * k, Phase.TAKING_OFF, "taking off"))
        observe(status(15.0, Phase.ABORTING, "the operator asked to land"))
    lines = out.getvalue().splitlines()
    assert lines[0] == "    0.0 s  idle"
    assert lines[1].startswith("    0.0 s  error 40.0 cm, battery 3.10 V, link 250 ms")
    assert lines[1].endswith("cf2: off its way [bold]")
    assert lines[2] == "    0.0 s  taking off"
    assert lines[-1] == "   15.0 s  aborting: the operator asked to land"
    assert len(lines) == 5  # figures once in ten seconds
