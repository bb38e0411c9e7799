"""Pareto dominance of vectors of objectives that are all to be small."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array

BLOCK = 256  # points compared with all others at once


def dominates(a: Array, b: Array) -> bool:
    """Whether ``a`` is nowhere worse than ``b`` and somewhere better (SLES, Definition 1)."""
    return bool((a <= b).all() and (a < b).any())


def non_dominated(points: Array) -> NDArray[np.bool_]:
    """(n,) which of ``points`` (n, m) no other dominates; of equal points, the first."""
    if len(points) == 0:
        return np.zeros(0, dtype=np.bool_)
    unique, first = np.unique(points, axis=0, return_index=True)
    keep = np.zeros(len(points), dtype=np.bool_)
    for begin in range(0, len(unique), BLOCK):
        block = unique[begin : begin + BLOCK]
        at_most = (unique[:, None] <= block[None]).all(
            axis=2
        )  # all are different: whoever is at most another dominates
        keep[first[begin : begin + BLOCK]] = at_most.sum(axis=0) == 1  # itself
    return keep
