"""Time averages over sub-periods, from every step or from fewer nodes.

A sum over the steps of a smooth function of time needs no more than every second or third of them, with weights that
are exact for what a cubic through neighbouring nodes can follow. Connection probabilities are double sums, so the
saving is squared. Reported figures always use every step.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array

STENCIL = 4  # nodes of the local interpolant: cubic


class Quadrature(NamedTuple):
    """Nodes and weights, both (sub-periods, n): mean over a sub-period ≈ Σ weights · f(step = nodes).

    Rows of shorter sub-periods are filled up in front with their first node at weight zero.
    """

    nodes: NDArray[np.intp]
    weights: Array


def every_step(bounds: Sequence[tuple[int, int]]) -> Quadrature:
    """The mean itself: every step of every sub-period (first, end exclusive), equally weighted."""
    return _filled([(np.arange(a, b), np.full(b - a, 1.0 / (b - a))) for a, b in bounds])


def thinned(bounds: Sequence[tuple[int, int]], stride: int) -> Quadrature:
    """About every ``stride``-th step, with weights that integrate the cubic interpolant exactly."""
    return _filled([_thinned(a, b, stride) for a, b in bounds])


def _thinned(first: int, end: int, stride: int) -> tuple[NDArray[np.intp], Array]:
    steps = np.arange(first, end)
    count = -(-(len(steps) - 1) // stride) + 1
    if stride <= 1 or count < STENCIL:
        return steps, np.full(len(steps), 1.0 / len(steps))
    nodes = np.round(np.linspace(first, end - 1, count)).astype(np.intp)
    weights = np.zeros(count)
    left = np.clip(np.searchsorted(nodes, steps, side="right") - STENCIL // 2, 0, count - STENCIL)
    stencil = left[:, None] + np.arange(STENCIL)  # (steps, 4) nodes each step is interpolated from
    x = nodes[stencil]
    for a in range(STENCIL):
        others = [b for b in range(STENCIL) if b != a]
        basis = np.prod([(steps - x[:, b]) / (x[:, a] - x[:, b]) for b in others], axis=0)
        np.add.at(weights, stencil[:, a], basis)
    return nodes, weights / len(steps)


def _filled(rows: list[tuple[NDArray[np.intp], Array]]) -> Quadrature:
    width = max(len(nodes) for nodes, _ in rows)
    nodes = np.stack([np.pad(n, (width - len(n), 0), mode="edge") for n, _ in rows])
    weights = np.stack([np.pad(w, (width - len(w), 0)) for _, w in rows])
    return Quadrature(nodes, weights)
