"""``ergoflie study``: a sweep over fields of a mission and seeds, resumable, one tidy table."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from deploy.cli.types import Subparsers


def add_parser(commands: Subparsers) -> None:
    """Add this command."""
    parser = commands.add_parser("study", help="run a sweep over mission fields and seeds; resumable; one tidy CSV")
    parser.add_argument("study", type=Path, help="study file (YAML)")
    parser.add_argument(
        "-o", "--output", type=Path, help="folder of the runs and the table [default: out/studies/<name>]"
    )
    parser.add_argument("--processes", type=_count, default=None, help="worker processes [default: one a core]")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run what is missing, write the table; Ctrl-C keeps what is done."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from deploy.cli.console import err
    from deploy.cli.planning import interruptible, print_done
    from planner.study import StudyProgress, load_study, run_study
    from planner.study.page import read_table
    from planner.study.plots import write_plots

    study = load_study(args.study)
    folder: Path = args.output or Path("out") / "studies" / study.name
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=err) as bar, interruptible() as stop:
        task = bar.add_task(study.name, total=None)

        def show(state: StudyProgress) -> None:
            bar.update(task, completed=state.done, total=state.total)

        table = run_study(study, folder, processes=args.processes, progress=show, should_stop=stop.is_set)
    print_done(f"table: {table}")
    rows = read_table(table)
    if missed := sum(row["feasible"] != "True" for row in rows):
        err.print(f"ergoflie: {missed} of {len(rows)} runs found no plan; the table says why")
    for picture in write_plots(study, rows, folder):
        print_done(f"plot: {picture}")
    if stop.is_set():
        err.print("ergoflie: interrupted; run the same command again to go on")
        return 130
    return 0


def _count(text: str) -> int:
    """A positive whole number."""
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"got '{text}'; allowed: a whole number from 1")
    return int(text)
