"""Four pictures of a search: the map, what the coefficients keep of it, what the trajectory made, the difference."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from missions.arrays import Array
from planner.ergodic.metric import ErgodicMetric


class Panels(NamedTuple):
    """Densities on the unit box, indexed [x, y(, z)], of mean 1 but for the difference.

    Attributes:
        given: the map as it is, of its own size.
        kept: the map from its coefficients φ_k. made: the trajectory's, from c_k. difference: kept − made.
    """

    given: Array
    kept: Array
    made: Array
    difference: Array


def panels(metric: ErgodicMetric, q: Array, density: Array, cells: int = 100) -> Panels:
    """The four views of PlanetaryRobotics' ``visualize``.

    Args:
        metric: basis and φ_k.
        q: (T, N, ν) positions [m].
        density: the map by cell, of any size.
        cells: of the reconstructions, an axis.
    """
    kept, made = (reconstructed(metric, c_k, cells) for c_k in (metric.phi_k, metric.statistics(q)))
    return Panels(density / density.mean(), kept, made, kept - made)


def reconstructed(metric: ErgodicMetric, c_k: Array, cells: int) -> Array:
    """Σ_k c_k F_k at the centres of cells, (cells,)*ν, from coefficients (n,)*ν."""
    basis = metric.basis
    centres = (np.arange(cells) + 0.5) / cells
    cosine = np.cos(np.pi * np.outer(np.arange(basis.n), centres))  # (n, cells)
    out = c_k / basis.h_k
    for _ in range(basis.dimension):  # each pass consumes the leading frequency and appends an axis of cells
        out = np.tensordot(out, cosine, axes=(0, 0))
    result: Array = out
    return result
