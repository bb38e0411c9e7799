"""``ergoflie pareto``: plans for many weightings of a mission's maps, a page to choose from, a file to pick from."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from deploy.cli.types import Subparsers
    from missions.schema import Mission
    from planner.pareto.front import Front, FrontSettings


def add_parser(commands: Subparsers) -> None:
    """Add this command."""
    parser = commands.add_parser("pareto", help="plans that trade several information maps; a page to choose from")
    parser.add_argument("mission", type=Path, help="mission file (YAML) with 'information: {type: several, …}'")
    parser.add_argument("-o", "--output", type=Path, help="folder of front and page [default: out/<mission>]")
    parser.add_argument(
        "--method",
        default="thin",
        help="thin: the ends, then where most is to be gained; a-sles, sles: the paper's lattices, from neighbour to "
        "neighbour; scalar: sles' grid, each from scratch; nsga2: a genetic baseline, needs 'ergoflie[pymoo]' "
        "[default: thin]",
    )
    parser.add_argument("--step", type=float, default=0.1, help="of the lattice [default: 0.1]")
    parser.add_argument("--refine", type=int, help="plans more where the front is thin [default: 9 with thin, else 0]")
    parser.add_argument("--radius", type=float, help="largest change of a weight from the mission's [default: any]")
    parser.add_argument("--seed", type=int, help="overrides the mission's solver.seed")
    parser.add_argument("--processes", type=int, help="searches at a time [default: one a core]")
    parser.add_argument("--json", action="store_true", help="print the front as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Cover the weights, write front and page; Ctrl-C keeps what is done."""
    import dataclasses

    from deploy.cli.console import err
    from deploy.cli.planning import interruptible, print_done
    from deploy.files import write_whole
    from deploy.front.build import build_front_page
    from missions.loader import load_mission
    from planner.pareto.file import front_text
    from planner.pareto.front import FrontError, FrontSettings

    mission = load_mission(args.mission)
    if args.seed is not None:
        mission = dataclasses.replace(mission, solver=dataclasses.replace(mission.solver, seed=args.seed))
    if args.processes is not None and args.processes < 0:
        raise FrontError(f"--processes: got {args.processes}; allowed: at least 0")
    settings = FrontSettings(args.method, args.step, args.refine, args.radius)
    folder: Path = args.output or Path("out") / mission.name
    folder.mkdir(parents=True, exist_ok=True)
    with interruptible() as stop:
        if settings.method == "nsga2":
            front = _bred(mission)
        else:
            front = _explored(mission, settings, folder, args.processes, stop.is_set)
    file, page = folder / f"{mission.name}.front.json", folder / f"{mission.name}.front.html"
    write_whole(file, front_text(front).encode())
    write_whole(page, build_front_page(front, str(file)).encode())
    _print(front, as_json=args.json)
    if not args.json:
        print_done(f"front: {file}")
        print_done(f"page: {page}")
    if stop.is_set():
        err.print("ergoflie: interrupted; run the same command again to go on")
        return 130
    return 0


def _explored(
    mission: Mission, settings: FrontSettings, folder: Path, processes: int | None, stop: Callable[[], bool]
) -> Front:
    """The front, with a progress bar."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from deploy.cli.console import err, number
    from planner.pareto.explore import explore
    from planner.pareto.work import FrontProgress

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[last]}"))
    with Progress(*columns, TimeElapsedColumn(), console=err, transient=not err.is_terminal) as bar:
        task = bar.add_task(mission.name, total=None, last="")

        def show(state: FrontProgress) -> None:
            last = "" if state.vector is None else "E " + ", ".join(map(number, state.vector))
            bar.update(task, completed=state.done, total=state.total, last=last)

        return explore(mission, settings, folder / "plans", processes=processes, progress=show, should_stop=stop)


def _bred(mission: Mission) -> Front:
    """The baseline's front, with a progress bar."""
    from rich.progress import Progress

    from deploy.cli.console import err
    from planner.pareto.genetic import GENERATIONS, genetic_front

    with Progress(console=err, transient=not err.is_terminal) as bar:
        task = bar.add_task(f"{mission.name}: NSGA-II", total=GENERATIONS)
        return genetic_front(mission, progress=lambda done: bar.update(task, completed=done))


def _print(front: Front, *, as_json: bool) -> None:
    """The front's figures, for machines or for people."""
    from deploy.cli.console import err, number, out, print_json, table
    from planner.pareto.episodes import widest_gap

    if as_json:
        points = [
            {"weights": point.weights.tolist(), "vector": point.vector.tolist(), "best": index in front.best}
            for index, point in enumerate(front.points)
        ]
        figures = {"hypervolume": front.hypervolume, "named": front.named, "maps": front.names, "notes": front.notes}
        print_json({"mission": front.mission.name, **figures, "points": points})
        return
    names = {index: name for name, index in front.named.items()}
    rows = [
        (
            str(index),
            names.get(index, ""),
            *(f"{weight:.2f}" for weight in point.weights),
            *(number(E) for E in point.vector),
            "" if index in front.best else "beaten",
        )
        for index, point in enumerate(front.points)
    ]
    titles = ("plan", "name", *(f"w {name}" for name in front.names), *(f"E {name}" for name in front.names), "")
    table(f"{front.mission.name}: front", titles, rows, right=range(2, 2 + 2 * len(front.names)))
    out.print(f"hyper-volume to (1, …, 1): {front.hypervolume:.4f}; {len(front.best)} of {len(front.points)} unbeaten")
    gap = widest_gap(front)
    if gap is not None:
        weights = ", ".join(f"{weight:.2f}" for weight in gap.weights)
        out.print(
            f"thinnest at weights {weights}: about {gap.gain:.1%} of what is between the ends; --refine goes on there"
        )
    for note in front.notes:
        err.print(f"ergoflie: {note}", markup=False)
