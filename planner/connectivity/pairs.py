"""Pairs of robots and sub-periods of the horizon."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray


def all_pairs(robots: int) -> NDArray[np.intp]:
    """(N(N−1)/2, 2) indices i < j, in lexicographic order."""
    return np.stack(np.triu_indices(robots, k=1), axis=-1)


def sub_period_bounds(steps: int, sub_periods: int) -> tuple[tuple[int, int], ...]:
    """First step and end (exclusive) of each sub-period; equal ones when ``sub_periods`` divides ``steps``."""
    if not 1 <= sub_periods <= steps:
        raise ValueError(f"{steps} steps cannot be divided into {sub_periods} sub-periods")
    edges = [round(p * steps / sub_periods) for p in range(sub_periods + 1)]
    return tuple(itertools.pairwise(edges))
