"""planner/PARETO.md: figures 4 to 7 of the SLES paper run again, ``python -m tests.benchmarks.pareto_paper [PAGE]``.

Rows of NSGA-II need pymoo; without it they say so.
"""

from __future__ import annotations

import itertools
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from missions.arrays import Array
from planner.pareto.drive import DriveProblem
from planner.pareto.exchange import search_all
from planner.pareto.front import FrontError
from planner.pareto.genetic import nsga2
from planner.pareto.hypervolume import hypervolume
from planner.pareto.sequence import search_in_order
from planner.pareto.simplex import Episode, adaptive, breadth_first, grid
from tests.benchmarks.pareto import thin
from tests.planner.moes import published

PAGE = Path(__file__).parents[2] / "planner" / "PARETO.md"
SEEDS = (0, 1, 2)
BOX = 0.05  # NSGA-II's controls, as the authors bounded them


@dataclass(frozen=True)
class Result:
    """What a method reached: points, iterations (evaluations for NSGA-II), CPU seconds, hyper-volume."""

    points: int
    iterations: int
    seconds: float
    volume: float


Method = Callable[[DriveProblem, int], Result]


def centre(problem: DriveProblem) -> Array:
    """Where SLES begins."""
    return np.full(len(problem.phi), 1.0 / len(problem.phi))


def lattice(problem: DriveProblem, kind: str, step: float) -> tuple[Episode, ...]:
    """Episodes of a method."""
    begin = centre(problem)
    if kind == "A-SLES":
        return breadth_first(adaptive(problem.distances, step, begin), begin)
    episodes = breadth_first(grid(len(begin), step), begin)
    return tuple(replace(episode, parent=None) for episode in episodes) if kind == "Scala." else episodes


def in_order(kind: str, step: float) -> Method:
    """One weighting after another, each until its objective is below 1e-3, as the authors do."""

    def run(problem: DriveProblem, seed: int) -> Result:
        start = time.process_time()
        front = search_in_order(problem, lattice(problem, kind, step), seed=seed)
        seconds = time.process_time() - start
        return Result(len(front.vectors), int(front.iterations.sum()), seconds, hypervolume(front.vectors))

    return run


def at_once(weights: Callable[[DriveProblem], Array]) -> Method:
    """All weightings in one search that exchanges plans."""

    def run(problem: DriveProblem, seed: int) -> Result:
        start = time.process_time()
        front = search_all(problem, weights(problem), seed=seed)
        seconds = time.process_time() - start
        return Result(len(front.vectors), 250 * len(front.vectors), seconds, hypervolume(front.vectors))

    return run


def bred(population: int, evaluations: int) -> Method:
    """NSGA-II."""

    def run(problem: DriveProblem, seed: int) -> Result:
        def objectives(z: Array) -> tuple[Array, Array]:
            return problem.vectors(z), np.full(len(z), -1.0)

        widest, generations = np.full(2 * problem.steps, BOX), evaluations // population
        start = time.process_time()
        found = nsga2(
            objectives, widest, maps=len(problem.phi), population=population, generations=generations, seed=seed
        )
        seconds = time.process_time() - start
        return Result(len(found.vectors), population * generations, seconds, hypervolume(found.vectors))

    return run


def weights_of(kind: str, step: float) -> Callable[[DriveProblem], Array]:
    """The weights of a method's lattice."""
    return lambda problem: np.array([episode.weights for episode in lattice(problem, kind, step)])


# Title, maps, rows: method, what the authors' code reached (points, iterations, CPU s as published / compiled, volume).
FIGURES: tuple[tuple[str, int, tuple[tuple[str, Method, str], ...]], ...] = (
    (
        "Fig. 4: two maps, SLES against NSGA-II",
        2,
        (
            ("SLES d = 0.1", in_order("SLES", 0.1), "11, 4 071, 63.2 / 4.9, 0.8676"),
            ("all at once, the same weights", at_once(weights_of("SLES", 0.1)), ""),
            ("NSGA-II, population 50", bred(50, 14_900), ""),
            ("NSGA-II, population 100", bred(100, 14_900), "100, 14 900, 197.8 / –, 0.8672"),
            ("NSGA-II, population 200", bred(200, 14_900), ""),
        ),
    ),
    (
        "Fig. 5: two maps, from scratch or from the neighbour",
        2,
        tuple(
            (f"{kind} {'d′' if kind == 'A-SLES' else 'd'} = {step:g}", in_order(kind, step), theirs)
            for kind, step, theirs in (
                ("Scala.", 0.2, ""),
                ("SLES", 0.2, ""),
                ("Scala.", 0.1, "11, 11 778, 163.0 / 10.3, 0.8671"),
                ("SLES", 0.1, "11, 4 071, 63.2 / 4.9, 0.8676"),
                ("A-SLES", 0.1, "10, 2 679, 59.1 / 3.3, 0.8647"),
                ("Scala.", 0.05, ""),
                ("SLES", 0.05, "21, 5 290, – / 5.3, 0.8799"),
            )
        ),
    ),
    (
        "Fig. 6: two maps, A-SLES with other steps",
        2,
        tuple((f"A-SLES d′ = {step:g}", in_order("A-SLES", step), "") for step in (0.3, 0.2, 0.1, 0.05, 0.025)),
    ),
    (
        "Fig. 7: three maps",
        3,
        (
            ("SLES d = 0.05", in_order("SLES", 0.05), "231, 60 942, – / 50.3, 0.8101"),
            ("A-SLES d′ = 0.05", in_order("A-SLES", 0.05), "84, 19 211, 244.0 / 19.0, 0.8025"),
            ("all at once, SLES' weights", at_once(weights_of("SLES", 0.05)), ""),
            ("all at once, A-SLES's weights", at_once(weights_of("A-SLES", 0.05)), ""),
            ("all at once, 60 weights, thinnest first", at_once(thin(60)), ""),
            ("NSGA-II, population 100", bred(100, 17_300), "100, 17 300, 319.6 / –, 0.7497"),
        ),
    ),
)

INTRODUCTION = """# Several maps: the paper's figures

Multi-Objective Ergodic Search (Ren, Srinivasan, Coffin, Abraham, Choset), figures 4 to 7, run with this planner on the
maps, start, dynamics, objective and constants of the authors' code: one differential-drive robot in the unit square, 50
steps. Written by `python -m tests.benchmarks.pareto_paper`; medians of three seeds, CPU seconds of one core of a loaded
machine. Hyper-volume is with respect to (1, …, 1). *In order* (SLES, A-SLES, Scala.), a search ends at an objective of
1e-3, as theirs, or once it has settled; theirs is Adam with a step of 1e-3, ours L-BFGS. *All at once* every weighting
has 250 iterations in one vectorised search, whatever it reaches, and takes over the best plan there is for it now and
then. Theirs: points, iterations, CPU seconds as published / with the step compiled once, hyper-volume, measured on
another machine.
"""


HEADINGS = "| | points | iterations | CPU s | volume | theirs |\n|---|---|---|---|---|---|\n"


def measured(maps: int, method: Method) -> Result | None:
    """Medians over seeds; None without pymoo."""
    problem = published(maps)
    try:
        results = [method(problem, seed) for seed in SEEDS]
    except FrontError:
        return None
    return Result(
        *(int(statistics.median(getattr(result, name) for result in results)) for name in ("points", "iterations")),
        *(statistics.median(getattr(result, name) for result in results) for name in ("seconds", "volume")),
    )


def page() -> str:
    """The page's text."""
    found: dict[tuple[str, str], Result] = {}
    parts = [INTRODUCTION]
    for title, maps, rows in FIGURES:
        parts.append(
            f"\n## {title}\n\n| | points | iterations | CPU s | volume | theirs |\n|---|---|---|---|---|---|\n"
        )
        for name, method, theirs in rows:
            result = measured(maps, method)
            if result is None:
                parts.append(f"| {name} | needs pymoo | | | | {theirs} |\n")
                continue
            found[title[:6], name] = result
            figures = f"{result.points} | {result.iterations} | {result.seconds:.2f} | {result.volume:.4f}"
            parts.append(f"| {name} | {figures} | {theirs} |\n")
            print(title[:6], name, figures, flush=True)
    return "".join(parts) + "\n## What agrees and what does not\n\n" + "".join(f"- {line}\n" for line in judged(found))


def judged(found: dict[tuple[str, str], Result]) -> list[str]:
    """The paper's claims, one line each."""
    lines = []
    for d in ("0.2", "0.1", "0.05"):
        warm, scratch = found["Fig. 5", f"SLES d = {d}"], found["Fig. 5", f"Scala. d = {d}"]
        share = warm.iterations / scratch.iterations
        lines.append(
            f"SLES needs less than half the iterations of scalarisation from scratch, d = {d}: "
            f"{'**agrees**' if share < 0.5 else '**fewer, but not half**' if share < 1.0 else '**does not**'} "
            f"({share:.2f} of them, volume {warm.volume - scratch.volume:+.4f})"
        )
    steps = [found["Fig. 6", f"A-SLES d′ = {step:g}"] for step in (0.3, 0.2, 0.1, 0.05, 0.025)]
    rises = all(a.volume < b.volume and a.iterations < b.iterations for a, b in itertools.pairwise(steps))
    lines.append(f"Smaller steps of A-SLES buy hyper-volume with time: **{'agrees' if rises else 'does not'}**")
    few, all_ = found["Fig. 7", "A-SLES d′ = 0.05"], found["Fig. 7", "SLES d = 0.05"]
    share = few.iterations / all_.iterations
    lines.append(
        f"Three maps, A-SLES: similar hyper-volume in less than half the time of SLES: "
        f"**{'agrees' if share < 0.5 else 'does not'}** "
        f"({share:.2f} of the iterations, volume {few.volume - all_.volume:+.4f})"
    )
    thinnest, few = (
        found["Fig. 7", "all at once, 60 weights, thinnest first"],
        found["Fig. 7", "all at once, A-SLES's weights"],
    )
    lines.append(
        f"Not in the paper: {thinnest.points} plans placed where the front is thin have more hyper-volume "
        f"({thinnest.volume:.4f}) than A-SLES's {few.points} ({few.volume:.4f}), all at once both"
    )
    if ("Fig. 4", "NSGA-II, population 100") in found:
        bred_, sles = found["Fig. 4", "NSGA-II, population 100"], found["Fig. 4", "SLES d = 0.1"]
        lines.append(
            f"SLES has as much hyper-volume as NSGA-II in a third of its time: "
            f"**{'agrees' if sles.volume >= bred_.volume and sles.seconds < bred_.seconds / 3 else 'does not'}** "
            f"({sles.volume:.4f} in {sles.seconds:.1f} s, {bred_.volume:.4f} in {bred_.seconds:.1f} s)"
        )
    return lines


def main() -> None:
    """Write the page."""
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else PAGE
    target.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
