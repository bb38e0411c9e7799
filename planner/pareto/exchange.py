"""All weights at once: every weight has a search of its own, and takes over whatever another has found for it.

Scalarised maps are scalarised objectives up to a constant (see :mod:`planner.pareto.ideal`), so what every plan
found so far is worth for every weight is one product of matrices. SLES hands plans on from neighbour to neighbour, in
the order in which it meets them; here whoever has the best one hands it on, and nobody waits for another.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from missions.arrays import Array
from planner.pareto.drive import DriveProblem
from planner.pareto.minimise import minimise

STAGES = (40, 40, 40, 130)  # iterations between exchanges
SPEED, SPREAD = 0.05, 0.02  # first guesses: this fast, straight on; standard deviation of all controls around that


class BatchFront(NamedTuple):
    """Plans for n weights: weights (n, m), controls (n, 2 T), vectors of objectives (n, m)."""

    weights: Array
    controls: Array
    vectors: Array


def search_all(problem: DriveProblem, weights: Array, *, seed: int = 0, stages: tuple[int, ...] = STAGES) -> BatchFront:
    """A plan for each of ``weights`` (n, m).

    Args:
        problem: maps and robot.
        weights: of the objectives.
        seed: of the first guesses, one each.
        stages: iterations, with an exchange between each and the next.
    """
    weights = np.asarray(weights, dtype=np.float64)
    phi = np.einsum("nm,mij->nij", weights, problem.phi)
    z = first_guesses(problem, len(weights), seed)
    for stage, iterations in enumerate(stages):
        if stage > 0:
            z = z[best_for(problem.vectors(z), weights)]
        z = minimise(lambda point: problem.evaluate(point, phi), z, iterations).z
    return BatchFront(weights, z, problem.vectors(z))


def first_guesses(problem: DriveProblem, count: int, seed: int) -> Array:
    """(count, 2 T) controls to begin with: straight on, more or less."""
    z = np.random.default_rng(seed).normal(scale=SPREAD, size=(count, 2 * problem.steps))
    z[:, : problem.steps] += SPEED
    return z


def best_for(vectors: Array, weights: Array) -> Array:
    """(n,) which of k plans with ``vectors`` (k, m) is best for each of ``weights`` (n, m); of equals, the first."""
    result: Array = (weights @ vectors.T).argmin(axis=1)
    return result
