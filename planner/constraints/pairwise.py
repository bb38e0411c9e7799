"""Constraints of pairs of robots in slots of time: what a connected graph can choose from."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from planner.constraints.base import Constraint, Place

Rows = NDArray[np.bool_] | NDArray[np.intp]


class PairConstraint(Constraint, Protocol):
    """A constraint whose residual and violation are (pairs, slots)."""

    @property
    def pairs(self) -> NDArray[np.intp]:
        """(pairs, 2) robot indices."""

    @property
    def names(self) -> tuple[str, ...]:
        """Of all robots."""

    def of(self, rows: Rows) -> PairConstraint:
        """The same for some of the pairs."""


def pair_and_sub_period(names: tuple[str, ...], pairs: NDArray[np.intp], index: tuple[int, ...]) -> Place:
    """Place of a component (pair, sub-period); sub-periods count from 1."""
    i, j = pairs[index[0]]
    return Place(f"{names[i]}-{names[j]}, sub-period {index[1] + 1}", None)


def pair_and_time(names: tuple[str, ...], pairs: NDArray[np.intp], row: int, time: float) -> Place:
    """Place of a pair at a time [s]."""
    i, j = pairs[row]
    return Place(f"{names[i]}-{names[j]}", time)
