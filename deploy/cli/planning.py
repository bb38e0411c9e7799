"""Planning as the command line shows it: progress, the table of what is violated, the figures of a plan."""

from __future__ import annotations

import dataclasses
import functools
import math
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from deploy.cli.certificate import print_certificate
from deploy.cli.console import err, number, out, table

if TYPE_CHECKING:
    from missions.schema import Mission
    from planner.errors import NoFeasiblePlan
    from planner.flightplan import FlightPlan
    from planner.solver.result import Progress as SolverProgress


def plan_mission(path: Path, *, seed: int | None = None) -> FlightPlan | None:
    """Load and plan a mission with a progress bar; print why if there is no plan.

    Ctrl-C ends the search early with the best feasible plan so far.
    """
    from missions.loader import load_mission
    from planner.pipeline import make_flight_plan

    mission = load_mission(path)
    if seed is not None:
        mission = dataclasses.replace(mission, solver=dataclasses.replace(mission.solver, seed=seed))
    return _shown(path, mission, functools.partial(make_flight_plan, mission))


def plan_pick(path: Path, pick: str) -> FlightPlan | None:
    """Make the plan that was picked from a front a flight, as :func:`plan_mission` does."""
    from planner.pareto.file import read_front
    from planner.pareto.pick import flight_plan_of

    front = read_front(path)
    front.find(pick)  # a pick that is not there is said before anything begins
    return _shown(path, front.mission, functools.partial(flight_plan_of, front, pick))


def _shown(path: Path, mission: Mission, planned: Callable[..., FlightPlan]) -> FlightPlan | None:
    """What ``planned`` makes, with a progress bar; None, with the reason printed, if that is no plan."""
    from planner.errors import CertificateFailed, NoFeasiblePlan

    try:
        with _progress_bar(mission.name, mission.solver.time_limit) as report, interruptible() as stop:
            return planned(progress=report, should_stop=stop.is_set)
    except NoFeasiblePlan as failure:
        print_violations(failure)
    except CertificateFailed as failure:
        print_certificate(failure.certificate, only_failed=True)
        err.print(f"ergoflie: {path}: {failure}")
    return None


def summary(flight_plan: FlightPlan) -> dict[str, object]:
    """A plan's figures for machines."""
    found = flight_plan.certificate.indicators
    return {
        "mission": flight_plan.mission.name,
        "certified": flight_plan.certificate.passed,
        "ergodicity_plan": flight_plan.plan.ergodicity,
        "ergodicity_certified": found.ergodicity,
        "ergodicity_by_map": _by_map(flight_plan),
        "probability_worst": found.probability_worst,
        "probability_mean": found.probability_mean,
        "connected_share": found.connected_share,
        "all_met": found.all_met,
        "smallest_separation_m": found.smallest_separation,
        "smallest_clearance_m": found.smallest_clearance,
        "bytes": {name: t.size for name, t in flight_plan.trajectories.items()},
        "pieces": {name: t.pieces for name, t in flight_plan.trajectories.items()},
        "seconds": flight_plan.plan.seconds,
        "evaluations": flight_plan.plan.evaluations,
        "seed": flight_plan.plan.seed,
    }


def print_plan(flight_plan: FlightPlan) -> None:
    """A plan's figures for people."""
    mission, found = flight_plan.mission, flight_plan.certificate.indicators
    probabilities = f"{number(found.probability_worst)} / {number(found.probability_mean)}"
    rows = [
        ("ergodicity E of the plan", number(flight_plan.plan.ergodicity)),
        ("ergodicity E of the certified polynomials", number(found.ergodicity)),
    ]
    rows += [(f"ergodicity E of the plan on {name}", number(E)) for name, E in _by_map(flight_plan).items()]
    if math.isfinite(found.probability_worst):
        rows.append(("connection probability, worst / mean", probabilities))
    if math.isfinite(found.connected_share):
        rows.append(("share of pair-time within range", number(found.connected_share)))
        rows.append(("every pair met in every sub-period", "yes" if found.all_met else "no"))
    if len(mission.robots) > 1:
        rows.append(("smallest separation", f"{number(found.smallest_separation)} m"))
    if mission.obstacles:
        rows.append(("smallest obstacle clearance", f"{number(found.smallest_clearance)} m"))
    if mission.object is not None:
        from planner.surface.seen import seen_surface

        seen = seen_surface(mission, flight_plan.plan.q[:-1])
        rows.append(("information on the object that is seen", f"{100.0 * seen.fraction:.0f} %"))
    if flight_plan.plan.evaluations:  # an imported plan has none
        rows.append(("solver", f"{flight_plan.plan.evaluations} evaluations, {flight_plan.plan.seconds:.1f} CPU s"))
    for name, encoded in flight_plan.trajectories.items():
        room = "of 4096" if len(encoded.legs) == 1 else f"in {len(encoded.legs)} legs"
        rows.append(
            (
                f"bytes for {name}",
                f"{encoded.size} {room}, {encoded.pieces} pieces, {encoded.legs[0].encoding.name.lower()}",
            )
        )
    table(f"{mission.name}: plan", ("figure", "value"), rows)


def _by_map(flight_plan: FlightPlan) -> dict[str, float]:
    """The plan's ergodicity on each of several maps; nothing where there is one."""
    from missions.information import SeveralMaps
    from planner.pareto.front import Maps

    if not isinstance(flight_plan.mission.information, SeveralMaps):
        return {}
    maps = Maps.of(flight_plan.mission)
    return dict(zip(maps.names, map(float, maps.vector(flight_plan.plan.q[:-1])), strict=True))


def print_violations(failure: NoFeasiblePlan) -> None:
    """What an infeasible plan violates: what, where, by how much."""
    rows = [
        (v.name, v.where, f"{number(v.amount)} {v.unit}", "" if v.time is None else f"{v.time:.1f} s")
        for v in failure.outcome.violations
    ]
    if rows:
        table("not met", ("constraint", "where", "by", "when"), rows)
    err.print(f"ergoflie: {failure}", markup=False)


@contextmanager
def _progress_bar(name: str, time_limit: float) -> Iterator[Callable[[SolverProgress], None]]:
    """A bar over the solver's time limit with E, the worst violation and the elapsed time."""
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        TextColumn("E {task.fields[E]}  worst {task.fields[worst]} m  {task.fields[phase]}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=err, transient=not err.is_terminal) as bar:
        task = bar.add_task(f"planning {name}", total=time_limit, E="–", worst="–", phase="")

        def report(state: SolverProgress) -> None:
            bar.update(
                task,
                completed=min(state.seconds, time_limit),
                E=f"{state.E:.2e}",
                worst=f"{state.violation_m:.4f}",
                phase=state.phase,
            )

        yield report
        bar.update(task, completed=time_limit)


@contextmanager
def interruptible() -> Iterator[threading.Event]:
    """Ctrl-C asks the solver to stop with what it has; a second one is an ordinary interrupt."""
    stop = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    before = signal.getsignal(signal.SIGINT)

    def ask(signum: int, frame: object) -> None:
        stop.set()
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, ask)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, before)


def print_done(text: str) -> None:
    """A closing line."""
    out.print(text, markup=False, soft_wrap=True)
