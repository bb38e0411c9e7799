"""Squared distances of pairs at chosen steps, and their gradient: what every same-time policy is made of."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array


class Distances(NamedTuple):
    """Distances of pairs at nodes: rows (e.g. sub-periods) of n steps each.

    Attributes:
        delta: (ν, pairs, rows, n) difference vectors [m].
        squares: (pairs, rows, n) squared distances [m²].
    """

    delta: Array
    squares: Array


def distances(q: Array, pairs: NDArray[np.intp], nodes: NDArray[np.intp]) -> Distances:
    """Distances at the steps ``nodes`` (rows, n) of positions q (T, N, ν) [m]."""
    x = np.ascontiguousarray(q[nodes].transpose(3, 2, 0, 1))  # (ν, N, rows, n): time last, where NumPy is fast
    delta = x[:, pairs[:, 0]] - x[:, pairs[:, 1]]
    return Distances(delta, (delta * delta).sum(axis=0))


def pull_squares(
    found: Distances, pairs: NDArray[np.intp], nodes: NDArray[np.intp], weights: Array, gradient: Array
) -> None:
    """Add the gradient of Σ weights · d² with respect to q to ``gradient`` (T, N, ν).

    Args:
        found: the distances.
        pairs: as given for them.
        nodes: likewise.
        weights: (pairs, rows, n).
        gradient: added to, in place.
    """
    force = found.delta * (2.0 * weights)
    robots = np.arange(gradient.shape[1])[:, None]
    incidence = (robots == pairs[:, 0]).astype(np.float64) - (robots == pairs[:, 1])  # (N, pairs)
    on_nodes = np.tensordot(incidence, force, axes=(1, 1))  # (N, ν, rows, n)
    np.add.at(gradient, nodes, on_nodes.transpose(2, 3, 0, 1))
