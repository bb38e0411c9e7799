"""``python -m tests.screenshots PLAN [-o DIR]``: the README's pictures, made of a rehearsal of a plan.

The dashboard as a terminal draws it (SVG), the report's playback as a browser does (PNG).
"""

from __future__ import annotations

import argparse
import io
import sys
import tempfile
from pathlib import Path

from rich.console import Console

from deploy.analysis import analyse
from deploy.cli.dashboard import Dashboard
from deploy.cli.flying import KEYS_HINT
from deploy.flight.records import FlightStatus
from deploy.flightlog.reader import read_log
from deploy.planfile import read_plan
from deploy.rehearsal import rehearse
from deploy.report import build_report
from tests.deploy.browser import CHROMIUM, Page, browser

FOLDER = Path("docs")
MOMENT = 21.5  # s of the search, for both pictures
WIDTH, HEIGHT = 1280, 900  # of the browser's window


def main() -> None:
    """Plan, rehearse, draw."""
    parser = argparse.ArgumentParser(prog="python -m tests.screenshots", description=__doc__)
    parser.add_argument("plan", type=Path, help="plan file of the flight to show")
    parser.add_argument("-o", "--output", type=Path, default=FOLDER, help="folder [default: docs]")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    plan, board, told = read_plan(arguments.plan), Dashboard(KEYS_HINT), list[FlightStatus]()

    def observe(status: FlightStatus) -> None:
        if not status.mission_time > MOMENT:  # also before the search, when it is NaN
            board.note(status)
            told.append(status)

    with tempfile.TemporaryDirectory() as folder:
        _, log = rehearse(plan, log_path=Path(folder) / "flight.mcap", observer=observe)
        (arguments.output / "dashboard.svg").write_text(dashboard(board, told[-1]), encoding="utf-8")
        if CHROMIUM is None:
            sys.exit("no Chromium on this machine: dashboard.svg only")
        page = Path(folder) / "report.html"
        page.write_text(build_report(analyse(read_log(log))), encoding="utf-8")
        report(page, arguments.output / "report.png")


def dashboard(board: Dashboard, status: FlightStatus) -> str:
    """The terminal at that moment, as SVG."""
    console = Console(file=io.StringIO(), width=104, record=True, force_terminal=True)
    console.print(board.view(status))
    return console.export_svg(title="ergoflie fly")


def report(page: Path, target: Path) -> None:
    """The report's playback in the middle of the search."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder, browser(Path(folder)) as socket:
        view = Page(socket, page.as_uri(), WIDTH, HEIGHT)
        view.ask(f"cursor.set({MOMENT})")
        view.ask("document.getElementById('playback').scrollIntoView()")
        view.settle()
        view.screenshot(target)


if __name__ == "__main__":
    main()
