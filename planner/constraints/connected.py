"""``graph: connected``: in every slot of time, pairs that meet the constraint connect all robots.

Which pairs is chosen: those of a minimum spanning tree under the residual, so the tree whose worst edge is least bad.
Within a round of the search the choice is fixed and the problem smooth; between rounds the search asks
:meth:`Connected.adapted` for a new choice. A tree in use is kept unless another is clearly better, or two equally good
ones would take turns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from missions.spanning import Mask, spanning_trees
from planner.constraints.base import Evaluation, Place
from planner.constraints.pairwise import PairConstraint
from planner.dynamics import Cotangent, Motion

NOT_ASKED = -1e6  # residual of pairs that are not in the tree: multipliers fall to zero at once
RELUCTANCE = 0.1  # by how much (m, or in log-probability) a tree has to be better to replace the one in use


@dataclass(frozen=True)
class Connected:
    """A constraint of pairs, asked for along spanning trees only.

    Attributes:
        inner: the constraint of every candidate pair.
        chosen: (pairs, slots) whether the pair is in the slot's tree.
    """

    inner: PairConstraint
    chosen: Mask

    @property
    def name(self) -> str:
        """As of the constraint inside, so that margins and messages are those."""
        return self.inner.name

    @property
    def unit(self) -> str:
        """As of the constraint inside."""
        return self.inner.unit

    @property
    def tolerance(self) -> float:
        """As of the constraint inside."""
        return self.inner.tolerance

    @property
    def pairs(self) -> NDArray[np.intp]:
        """(pairs, 2) candidates."""
        return self.inner.pairs

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (pairs, slots) along the chosen trees."""
        rows = np.flatnonzero(self.chosen.any(axis=1))
        chosen = self.chosen[rows]
        part = self.inner.of(rows).evaluate(motion)
        residual = np.full(self.chosen.shape, NOT_ASKED)
        residual[rows] = np.where(chosen, part.residual, NOT_ASKED)

        def pull(weights: Array, cotangent: Cotangent) -> None:
            part.pull(np.where(chosen, weights[rows], 0.0), cotangent)

        return Evaluation(residual, pull)

    def violation(self, motion: Motion) -> Array:
        """(pairs, slots) of the best trees there are, whatever was chosen."""
        amounts = self.inner.violation(motion)
        return np.where(self._trees(amounts), amounts, NOT_ASKED)

    def place(self, index: tuple[int, ...]) -> Place:
        """As of the constraint inside."""
        return self.inner.place(index)

    def adapted(self, motion: Motion) -> Connected:
        """The same with the trees that suit this motion."""
        residual = self.inner.evaluate(motion).residual
        chosen = self._trees(np.where(self.chosen, residual - RELUCTANCE, residual))
        return self if np.array_equal(chosen, self.chosen) else replace(self, chosen=chosen)

    def _trees(self, weights: Array) -> Mask:
        return spanning_trees(weights, self.inner.pairs, len(self.inner.names))


def connected(inner: PairConstraint, motion: Motion) -> Connected:
    """The constraint along the trees that suit a motion, e.g. that of robots that stay at their starts."""
    nobody = np.zeros_like(inner.evaluate(motion).residual, dtype=bool)
    return Connected(inner, nobody).adapted(motion)
