"""What a constraint is."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.dynamics import Cotangent, Motion


class Evaluation(NamedTuple):
    """A constraint at a motion.

    Attributes:
        residual: g, any shape; satisfied where g ≤ 0.
        pull: ``pull(weights, cotangent)`` adds the gradient of Σ weights · g to the cotangent.
    """

    residual: Array
    pull: Callable[[Array, Cotangent], None]


class Rows(NamedTuple):
    """Gradients of the components of a residual that are in force, one a column.

    Attributes:
        part: of the motion that they are by: q, v, u or q_fine.
        samples: (c, M) rows of that part. shares: (c, M) by how much each counts.
        robots: (r, M) whom they concern. forces: (r, ν, M) gradient by where each of them is, maybe
            along the first axes only.
    """

    part: str
    samples: NDArray[np.intp]
    shares: Array
    robots: NDArray[np.intp]
    forces: Array


class Place(NamedTuple):
    """Where and when one component of a residual lives."""

    where: str
    time: float | None


class Constraint(Protocol):
    """A family of inequalities g ≤ 0 of one kind."""

    @property
    def name(self) -> str:
        """What is constrained, e.g. ``separation``."""

    @property
    def unit(self) -> str:
        """Unit of g: metres for distances, "" for logarithms of probabilities."""

    @property
    def tolerance(self) -> float:
        """What counts as met: 1 mm for distances, and its like in other units."""

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual and vector-Jacobian product at a motion."""

    def violation(self, motion: Motion) -> Array:
        """By how much each component misses its limit, exactly, in :attr:`unit` (negative: has room)."""

    def place(self, index: tuple[int, ...]) -> Place:
        """Who, and when, a component of the residual speaks of."""


@runtime_checkable
class Adaptive(Protocol):
    """A constraint that chooses what it asks for, e.g. which pairs connect the robots."""

    def adapted(self, motion: Motion) -> Constraint:
        """The same with the choice that suits this motion; itself if that is the choice it has."""


@runtime_checkable
class Curved(Protocol):
    """A constraint that tells gradients of its components: the curvature of its penalty is made of them."""

    def rows(self, motion: Motion, weights: Array) -> Rows:
        """Of the components whose weight is not zero."""


@runtime_checkable
class Stackable(Protocol):
    """A constraint that can hold several swarms at once, who do not see each other: swarm after swarm in the robots."""

    @property
    def swarm_axis(self) -> int:
        """Axis of the residual along which swarm follows swarm."""

    def stacked(self, swarms: int, robots: int) -> Constraint:
        """The same for ``swarms`` swarms of ``robots`` robots each."""


def stacked_pairs(pairs: NDArray[np.intp], swarms: int, robots: int) -> NDArray[np.intp]:
    """Pairs of robots within each of several swarms, (swarms · pairs, 2)."""
    result: NDArray[np.intp] = (pairs + robots * np.arange(swarms)[:, None, None]).reshape(-1, 2)
    return result


def adapted(constraint: Constraint, motion: Motion) -> Constraint:
    """The constraint to search on with from this motion: most are as they are."""
    return constraint.adapted(motion) if isinstance(constraint, Adaptive) else constraint
