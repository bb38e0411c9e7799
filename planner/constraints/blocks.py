"""Broad phase: which pairs of robots may be close, in blocks of time.

A box around every robot's samples of a block is cheap to compare; only pairs whose boxes are near need their distances
worked out sample by sample. What is left is close to linear in robots.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array

BLOCK = 5  # samples a block


def box_gaps(x: Array, pairs: NDArray[np.intp]) -> Array:
    """Squared distances between boxes around blocks of samples, (pairs, blocks): never above the samples' own.

    Args:
        x: (ν, N, S) positions.
        pairs: (pairs, 2) robot indices.
    """
    edges = np.arange(0, x.shape[2], BLOCK)
    low, high = np.minimum.reduceat(x, edges, axis=2), np.maximum.reduceat(x, edges, axis=2)
    i, j = pairs[:, 0], pairs[:, 1]
    squares = np.zeros((len(pairs), len(edges)))
    for d in range(len(x)):
        gap = np.maximum(low[d][i] - high[d][j], low[d][j] - high[d][i])
        np.maximum(gap, 0.0, out=gap)
        gap *= gap
        squares += gap
    return squares
