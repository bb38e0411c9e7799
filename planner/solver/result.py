"""What a solve reports while it runs and when it ends."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from planner.plan import Plan


class SolveStatus(Enum):
    """How a solve ended; values are messages."""

    CONVERGED = "every limit is met and the ergodicity has settled"
    FEASIBLE_AT_TIME_LIMIT = "every limit is met; the time limit ended the search for a better ergodicity"
    FEASIBLE_AT_INTERRUPTION = "every limit is met; the search for a better ergodicity was interrupted"
    FEASIBLE_AT_EFFORT_LIMIT = "every limit is met; the ergodicity was still falling when the rounds were used up"
    TIME_LIMIT = "no plan met every limit within the time limit; allow more time or loosen the limits named"
    INTERRUPTED = "interrupted before a plan met every limit"
    INFEASIBLE = "no plan that meets every limit was found; the limits named stand against each other"

    @property
    def feasible(self) -> bool:
        """Whether a plan comes with it."""
        return self in _FEASIBLE


_FEASIBLE = {
    SolveStatus.CONVERGED,
    SolveStatus.FEASIBLE_AT_TIME_LIMIT,
    SolveStatus.FEASIBLE_AT_INTERRUPTION,
    SolveStatus.FEASIBLE_AT_EFFORT_LIMIT,
}


@dataclass(frozen=True)
class Violation:
    """A limit that is missed.

    Attributes:
        name: constraint. where: who. amount: by how much, in unit. time: when [s], None if it has no instant.
    """

    name: str
    where: str
    amount: float
    unit: str
    time: float | None

    def __str__(self) -> str:
        instant = "" if self.time is None else f" at {self.time:.2f} s"
        return f"{self.name} missed by {self.amount:.3g} {self.unit}".rstrip() + f" ({self.where}{instant})"


@dataclass(frozen=True)
class Progress:
    """Where a solve stands.

    Attributes:
        E: ergodicity. violation_m: worst violation [m, or a thousandth of it per tolerance of another unit].
        seconds: CPU seconds so far. evaluations: of objective, constraints and gradient. phase: in words.
    """

    E: float
    violation_m: float
    seconds: float
    evaluations: int
    phase: str


@dataclass(frozen=True)
class SolveOutcome:
    """A plan, or why there is none.

    Attributes:
        plan: the best plan that meets every limit; None if there is none, so that none can leave.
        status: how the solve ended.
        violations: worst miss of each constraint that the best motion misses, largest first; empty with a plan.
        history: one entry a round.
    """

    plan: Plan | None
    status: SolveStatus
    violations: tuple[Violation, ...] = ()
    history: tuple[Progress, ...] = ()
