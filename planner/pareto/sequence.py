"""Weights one after another, as SLES was published: each search begins with its parent's plan, and ends soon."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.pareto.drive import DriveProblem
from planner.pareto.exchange import first_guesses
from planner.pareto.minimise import minimise
from planner.pareto.simplex import Episode

ENOUGH = 1e-3  # objective at which the authors' searches end
MOST = 3000  # iterations of a search


class OrderedFront(NamedTuple):
    """Plans of n episodes: controls (n, 2 T), vectors of objectives (n, m), iterations (n,) that each took."""

    controls: Array
    vectors: Array
    iterations: NDArray[np.int_]


def search_in_order(
    problem: DriveProblem, episodes: Sequence[Episode], *, enough: float = ENOUGH, seed: int = 0
) -> OrderedFront:
    """A plan for each episode, in their order.

    Args:
        problem: maps and robot.
        episodes: weights and parents.
        enough: objective of the scalarised map at which a search ends.
        seed: of the first guess, which is the same for all searches from scratch.
    """
    scratch = first_guesses(problem, 1, seed)[0]
    controls: list[Array] = []
    iterations: list[int] = []
    for episode in episodes:
        begin = scratch if episode.parent is None else controls[episode.parent]
        phi = np.einsum("m,mij->ij", episode.weights, problem.phi)[None]
        found = minimise(lambda z, phi=phi: problem.evaluate(z, phi), begin[None], MOST, enough)  # type: ignore[misc]
        controls.append(found.z[0])
        iterations.append(found.iterations)
    stacked = np.array(controls)
    return OrderedFront(stacked, problem.vectors(stacked), np.array(iterations))
