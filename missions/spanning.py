"""Minimum spanning trees of robots: which pairs connect everybody at the least worst effort."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array

Mask = NDArray[np.bool_]


def spanning_trees(weights: Array, pairs: Sequence[Sequence[int]] | NDArray[np.intp], robots: int) -> Mask:
    """A minimum spanning tree in every slot (Prim, all slots at once).

    It also has the smallest largest edge of all spanning trees: the graph of the pairs with weights up to w connects
    everybody if and only if no edge of the tree is heavier than w.

    Args:
        weights: (pairs, slots) weight of each pair in each slot, e.g. a sub-period.
        pairs: (pairs, 2) robot indices.
        robots: N.

    Returns:
        (pairs, slots) whether the pair is in the slot's tree; a forest where the pairs do not connect everybody.
    """
    count, slots = weights.shape
    edge = np.full((robots, robots), count)  # row of each pair; pairs that are none have a row of infinite weight
    for row, (i, j) in enumerate(pairs):
        edge[i, j] = edge[j, i] = row
    padded = np.concatenate([weights, np.full((1, slots), np.inf)])
    slot = np.arange(slots)
    chosen = np.zeros((count + 1, slots), dtype=bool)
    reached = np.zeros((slots, robots), dtype=bool)
    reached[:, 0] = True
    via = np.broadcast_to(edge[0], (slots, robots)).copy()  # lightest pair that leads from the tree to each robot
    least = padded[edge[0]].T.copy()
    for _ in range(robots - 1):
        open_ = np.where(reached, np.inf, least)
        new = open_.argmin(axis=1)
        new = np.where(np.isfinite(open_[slot, new]), new, 0)  # nobody left in reach: robot 0 again, without a pair
        chosen[np.where(new > 0, via[slot, new], count), slot] = True
        reached[slot, new] = True
        offered = padded[edge[new], slot[:, None]]
        closer = offered < least
        least, via = np.where(closer, offered, least), np.where(closer, edge[new], via)
    return chosen[:count]


def bottlenecks(weights: Array, pairs: Sequence[Sequence[int]] | NDArray[np.intp], robots: int) -> NDArray[np.intp]:
    """(slots,) the pair (row) that is the heaviest edge of each slot's minimum spanning tree."""
    tree = spanning_trees(weights, pairs, robots)
    heaviest: NDArray[np.intp] = np.where(tree, weights, -np.inf).argmax(axis=0)
    return heaviest
