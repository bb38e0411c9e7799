"""Policy ``all_time``: pairs are in contact all the time (IMEC baseline B1), at the steps and between them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.connectivity.distances import Distances, distances, pull_squares
from planner.constraints.base import Evaluation, Place
from planner.constraints.pairwise import Rows, pair_and_time
from planner.dynamics import Cotangent, Motion


@dataclass(frozen=True)
class Contact:
    """g = (d² − R²)/(2 R), in metres to first order at the limit.

    Attributes:
        range: (pairs,) R [m].
        pairs: (pairs, 2) robot indices.
        names: of all robots. dt: time between fine samples [s].
    """

    range: Array
    pairs: NDArray[np.intp]
    names: tuple[str, ...]
    dt: float
    name: str = "contact at all times"
    unit: str = "m"
    tolerance: float = 1e-3

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (pairs, S) over the fine samples."""
        found, nodes = self._distances(motion)
        R = self.range[:, None]

        def pull(weights: Array, cotangent: Cotangent) -> None:
            pull_squares(found, self.pairs, nodes, (weights / (2.0 * R))[:, None], cotangent.q_fine)

        return Evaluation((found.squares[:, 0] - R**2) / (2.0 * R), pull)

    def violation(self, motion: Motion) -> Array:
        """D − R [m], (pairs, S)."""
        distance: Array = np.sqrt(self._distances(motion)[0].squares[:, 0])
        return distance - self.range[:, None]

    def place(self, index: tuple[int, ...]) -> Place:
        """The pair, the instant."""
        return pair_and_time(self.names, self.pairs, index[0], index[1] * self.dt)

    def of(self, rows: Rows) -> Contact:
        """The same for some of the pairs."""
        return replace(self, pairs=self.pairs[rows], range=self.range[rows])

    def _distances(self, motion: Motion) -> tuple[Distances, NDArray[np.intp]]:
        nodes = np.arange(len(motion.q_fine))[None]
        return distances(motion.q_fine, self.pairs, nodes), nodes
