"""Broad phase: which pairs of robots, or robots and places, may be close, in blocks of time.

A box around every robot's path in a block of steps is cheap to compare; only where boxes are near are closest
approaches worked out step by step. What is left is close to linear in robots.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array

BLOCK = 4  # steps a block: more make boxes too large, fewer make too many


def box_gaps(low: Array, high: Array, other_low: Array, other_high: Array) -> Array:
    """Squared distances between boxes, broadcast: never above those of what is in them.

    Args:
        low: (ν, ...) lower corners.
        high: (ν, ...) upper corners.
        other_low: (ν, ...) of the other boxes.
        other_high: (ν, ...) of the other boxes.
    """
    squares: Array | float = 0.0
    for d in range(len(low)):
        gap = np.maximum(low[d] - other_high[d], other_low[d] - high[d])
        np.maximum(gap, 0.0, out=gap)
        gap *= gap
        squares = squares + gap
    return np.asarray(squares)


def spans_of(
    pairs: NDArray[np.intp], blocks: NDArray[np.intp], count: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pairs and spans (M,) of blocks of spans, of ``count`` spans in all: the last block may be short."""
    spans = blocks[:, None] * BLOCK + np.arange(BLOCK)
    inside = spans < count
    return np.broadcast_to(pairs[:, None], spans.shape)[inside], spans[inside]
