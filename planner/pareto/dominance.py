"""Pareto dominance of vectors of objectives that are all to be small."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array


def dominates(a: Array, b: Array) -> bool:
    """Whether ``a`` is nowhere worse than ``b`` and somewhere better (SLES, Definition 1)."""
    return bool((a <= b).all() and (a < b).any())


def non_dominated(points: Array) -> NDArray[np.bool_]:
    """(n,) which of ``points`` (n, m) no other dominates; of equal points, the first."""
    if len(points) == 0:
        return np.zeros(0, dtype=np.bool_)
    unique, first = np.unique(points, axis=0, return_index=True)  # sorted: who dominates comes first
    kept = np.empty((0, points.shape[1]))
    keep = np.zeros(len(points), dtype=np.bool_)
    for point, number in zip(unique, first, strict=True):
        if not (kept <= point).all(axis=1).any():
            kept = np.vstack((kept, point))
            keep[number] = True
    return keep
