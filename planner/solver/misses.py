"""By how much a motion misses a problem's limits, in words and as one number."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from planner.constraints.base import Constraint
from planner.dynamics import Motion
from planner.solver.result import Violation

METRE_TOLERANCE = 1e-3  # [m] what one tolerance of any unit is worth when violations are compared


def worst_miss(constraints: Iterable[Constraint], motion: Motion) -> float:
    """Largest exact violation in tolerances, as a length [m equivalent]; negative if there is room."""
    return max(
        (METRE_TOLERANCE * float(c.violation(motion).max()) / c.tolerance for c in constraints), default=-math.inf
    )


def violations(constraints: Iterable[Constraint], motion: Motion) -> tuple[Violation, ...]:
    """The worst miss of each constraint that is missed, largest (in tolerances) first."""
    missed = []
    for constraint in constraints:
        amounts = constraint.violation(motion)
        index = np.unravel_index(int(np.argmax(amounts)), amounts.shape)
        amount = float(amounts[index])
        if amount > constraint.tolerance:
            place = constraint.place(tuple(int(i) for i in index))
            violation = Violation(constraint.name, place.where, amount, constraint.unit, place.time)
            missed.append((amount / constraint.tolerance, violation))
    return tuple(violation for _, violation in sorted(missed, key=lambda item: -item[0]))
