"""Rows of fronts: the published cases of SLES, all weights at once, against what the authors' code reached."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import missions
from missions.arrays import Array
from missions.loader import load_mission
from planner.pareto import simplex
from planner.pareto.drive import DriveProblem
from planner.pareto.exchange import search_all
from planner.pareto.explore import explore
from planner.pareto.front import FrontSettings
from planner.pareto.hypervolume import hypervolume
from planner.pareto.ideal import gaps, ideal_vectors
from tests.planner.moes import published

EXAMPLES = Path(missions.__file__).parent / "examples"
CANDIDATES = {2: 100, 3: 30}  # divisions of the grid that gaps are looked for on


@dataclass(frozen=True)
class Case:
    """A row.

    Attributes:
        name: of the method. maps: 2 or 3. weights: of the points, from the problem.
        authors: points, hyper-volume, CPU s as published and compiled. ask: of issue 8. coded: whose constants.
    """

    name: str
    maps: int
    weights: Callable[[DriveProblem], Array]
    authors: str = ""
    ask: str = ""
    coded: bool = True


def sles(step: float) -> Callable[[DriveProblem], Array]:
    """The regular grid."""
    return lambda problem: _weights(simplex.breadth_first(simplex.grid(len(problem.phi), step), _begin(problem)))


def a_sles(step: float, *, ends: bool = False) -> Callable[[DriveProblem], Array]:
    """A-SLES's lattice from the first map's corner, where the authors' begins; with ``ends`` the other corners, too."""

    def weights(problem: DriveProblem) -> Array:
        begin = _begin(problem)
        episodes = simplex.breadth_first(simplex.adaptive(problem.distances, step, begin), begin)
        return _weights(simplex.with_corners(episodes, len(begin)) if ends else episodes)

    return weights


def thin(count: int) -> Callable[[DriveProblem], Array]:
    """Corners, then wherever the ideal front is thinnest."""

    def weights(problem: DriveProblem) -> Array:
        corners = np.eye(len(problem.phi))
        everywhere = sles(1.0 / CANDIDATES[len(corners)])(problem)
        ideal = ideal_vectors(corners, problem.distances)
        found = gaps(everywhere, corners, ideal, problem.distances, count - len(corners))
        return np.array([*corners, *(gap.weights for gap in found)])

    return weights


def _begin(problem: DriveProblem) -> Array:
    return np.eye(len(problem.phi))[0]


def _weights(episodes: tuple[simplex.Episode, ...]) -> Array:
    return np.array([episode.weights for episode in episodes])


CASES = (
    Case("SLES d = 0.1", 2, sles(0.1), "11  0.8676   63.2 /  4.9", "0.8676 in 1"),
    Case("A-SLES d' = 0.1", 2, a_sles(0.1, ends=True), "10  0.8647   59.1 /  3.3", "0.8647 in 1"),
    Case("SLES d = 0.05", 2, sles(0.05), "21  0.8799      – /  5.3", "0.8799 in 1"),
    Case("thinnest first", 2, thin(10), "", ""),
    Case("A-SLES d' = 0.05", 3, a_sles(0.05), "84  0.8025  244.0 / 19.0", "0.8025 in 5"),
    Case("thinnest first", 3, thin(60), "", ""),
    Case("SLES d = 0.05", 3, sles(0.05), "231 0.8101    cut / 50.3", "0.8101 in 12"),
    Case("SLES d = 0.1, textbook", 2, sles(0.1), coded=False),
    Case("A-SLES d' = 0.05, textbook", 3, a_sles(0.05), coded=False),
    Case("thinnest first, textbook", 3, thin(60), coded=False),
    Case("SLES d = 0.05, textbook", 3, sles(0.05), coded=False),
)
MISSIONS = (
    ("two_maps.yaml", FrontSettings("scalar", step=0.2)),
    ("two_maps.yaml", FrontSettings("sles", step=0.2)),
    ("two_maps.yaml", FrontSettings("thin", refine=3)),
    ("three_maps.yaml", FrontSettings("thin", refine=3)),
)
HEADER = (
    f"{'front, one robot':36s} | {'authors: points, volume, CPU s':30s} | {'ask':12s} | "
    "points | CPU s  | volume | ideal"
)


def measure(case: Case) -> str:
    """A row: CPU seconds with the choice of weights, hyper-volume, and that of the ideal front at the same weights."""
    problem = published(case.maps, coded=case.coded)
    start = time.process_time()
    front = search_all(problem, case.weights(problem))
    seconds = time.process_time() - start
    volume = hypervolume(front.vectors)
    ideal = hypervolume(ideal_vectors(front.weights, problem.distances))
    return (
        f"{f'{case.maps} maps, {case.name}':36s} | {case.authors:30s} | {case.ask:12s} | {len(front.weights):6d} | "
        f"{seconds:6.2f} | {volume:.4f} | {ideal:.4f}"
    )


def of_mission(name: str, settings: FrontSettings) -> str:
    """A row of a shipped mission: CPU seconds with everything, in this process."""
    mission = load_mission(EXAMPLES / name)
    start = time.process_time()
    front = explore(mission, settings, processes=0)
    seconds = time.process_time() - start
    return (
        f"{f'{name}, {settings.method}':36s} | {'':30s} | {'':12s} | {len(front.points):6d} | "
        f"{seconds:6.2f} | {front.hypervolume:.4f} | {front.ideal:.4f}"
    )


def run() -> None:
    """Print the table."""
    print(HEADER)
    for case in CASES:
        print(measure(case), flush=True)
    for name, settings in MISSIONS:
        print(of_mission(name, settings), flush=True)


if __name__ == "__main__":
    run()
