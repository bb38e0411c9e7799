"""What a footprint is to the metric: statistics of what robots see, and how those change as the robots move."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple, Protocol

import numpy as np

from missions.arrays import Array, frozen
from planner.ergodic.basis import CosineBasis


class Look(NamedTuple):
    """What is seen along a motion.

    Attributes:
        c_k: (n, n) mean over steps and robots of the footprint's coefficients, c_0 = 1 (FEO, Eq. 5 and 6).
        pull: ``pull(weights)`` is the gradient (T, N, 3) [1/m] of Σ weights · c_k by the positions.
    """

    c_k: Array
    pull: Callable[[Array], Array]


class Footprint(Protocol):
    """A density over the plane of the information, by where a robot is."""

    def look(self, basis: CosineBasis, x: Array) -> Look:
        """Statistics over the box of ``basis`` (two axes) of robots at x (T, N, 3) [m]."""

    def each(self, basis: CosineBasis, x: Array) -> Array:
        """The same of every step by itself, (T, n, n): their mean is what :meth:`look` returns."""


def step_by_step(footprint: Footprint, basis: CosineBasis, x: Array) -> Array:
    """:meth:`Footprint.each` of footprints that depend on where a robot is, not on how it moves."""
    return np.stack([footprint.look(basis, x[t : t + 1]).c_k for t in range(len(x))])


def weighted_statistics(basis: CosineBasis, points: Array, weights: Array) -> tuple[Array, Callable[[Array], Seen]]:
    """Σ_m weights_m F_k(points_m), (n, n), and its pull: see :class:`Seen`.

    Args:
        basis: of two axes.
        points: (M, 2) [m].
        weights: (M,).
    """
    tables = basis.tables(points)
    (C_x, C_y), (S_x, S_y) = tables.cosine.swapaxes(0, 1), tables.sine.swapaxes(0, 1)  # (n, M) each
    c_k: Array = (C_x * weights) @ C_y.T / basis.h_k
    k = np.arange(basis.n, dtype=np.float64)[:, None]
    rate = -np.pi / (basis.upper - basis.lower)

    def pull(adjoint: Array) -> Seen:
        G = adjoint / basis.h_k
        along_y = G @ C_y  # (n, M): Σ_b G_ab C_b(y)
        value = np.einsum("am,am->m", C_x, along_y)
        by_x = rate[0] * np.einsum("am,am->m", k * S_x, along_y)
        by_y = rate[1] * np.einsum("bm,bm->m", k * S_y, G.T @ C_x)
        return Seen(value, np.stack((by_x, by_y), axis=-1))

    return c_k, pull


@lru_cache(maxsize=16)
def gauss(count: int) -> tuple[Array, Array]:
    """Gauss's nodes in (0, 1) and weights that sum to 1, (count,) each; finding them takes longer than using them."""
    node, weight = np.polynomial.legendre.leggauss(count)
    return frozen(0.5 * (node + 1.0)), frozen(0.5 * weight)


class Seen(NamedTuple):
    """A field Σ_k adjoint_k F_k at points.

    Attributes:
        value: (M,). gradient: (M, 2) [1/m].
    """

    value: Array
    gradient: Array
