"""Policy ``periodic``: pairs are in contact at given instants (IMEC, Eq. 31a)."""

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
class Rendezvous:
    """g = (d² − R²)/(2 R) at the instants, in metres to first order at the limit; smooth where robots coincide.

    Attributes:
        range: (pairs,) R [m].
        pairs: (pairs, 2) robot indices.
        steps: (instants,) when.
        names: of all robots. dt: planning step [s].
    """

    range: Array
    pairs: NDArray[np.intp]
    steps: NDArray[np.intp]
    names: tuple[str, ...]
    dt: float
    name: str = "rendezvous"
    unit: str = "m"
    tolerance: float = 1e-3

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (pairs, instants)."""
        found = self._distances(motion)
        R = self.range[:, None]

        def pull(weights: Array, cotangent: Cotangent) -> None:
            pull_squares(found, self.pairs, self.steps[:, None], (weights / (2.0 * R))[..., None], cotangent.q)

        return Evaluation((found.squares[..., 0] - R**2) / (2.0 * R), pull)

    def violation(self, motion: Motion) -> Array:
        """D − R [m], (pairs, instants)."""
        distance: Array = np.sqrt(self._distances(motion).squares[..., 0])
        return distance - self.range[:, None]

    def place(self, index: tuple[int, ...]) -> Place:
        """The pair, the instant."""
        return pair_and_time(self.names, self.pairs, index[0], float(self.steps[index[1]] * self.dt))

    def of(self, rows: Rows) -> Rendezvous:
        """The same for some of the pairs."""
        return replace(self, pairs=self.pairs[rows], range=self.range[rows])

    def _distances(self, motion: Motion) -> Distances:
        return distances(motion.q, self.pairs, self.steps[:, None])
