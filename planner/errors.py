"""Errors of the planner.

::

    PlannerError              base: str() is one line for a person
    ├── NotFlyableError       plans of these dynamics become no polynomials
    ├── UnreachableError      a constraint no motion can meet; names it and the bound that proves it
    ├── NoFeasiblePlan        the search ended without a plan that meets every limit; carries the outcome
    ├── CertificateFailed     what would fly misses the mission's limits; carries the certificate
    ├── FrontError            a Pareto front that cannot be made, read or picked from (planner/pareto/front.py)
    ├── WeightSpaceError      more weightings than make sense, or maps that span no simplex (planner/pareto/simplex.py)
    ├── TransferError         no safe way to the starts or back (planner/transfer/errors.py)
    ├── TrajectoryError       polynomials or bytes that cannot be made or read (planner/trajectory/errors.py)
    ├── InterchangeError      what others planned is no search of this mission (planner/interchange/errors.py)
    └── CertificateError      a certificate for other bytes or another mission (planner/certificate/errors.py)
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the records come from modules that raise these errors
    from planner.certificate.record import Certificate
    from planner.solver.result import SolveOutcome


class PlannerError(ValueError):
    """Base of the planner's errors."""


class NotFlyableError(PlannerError):
    """Dynamics for studies: their plans become no polynomials, so there is nothing to certify or to fly.

    Args:
        dynamics: type of the mission's dynamics.
    """

    def __init__(self, dynamics: str) -> None:
        self.dynamics = dynamics
        super().__init__(
            f"dynamics of type {dynamics} are for studies: their plans have no bounded acceleration that polynomials "
            "could follow. Plan them with planner.solve, or fly type double_integrator"
        )


class UnreachableError(PlannerError):
    """No motion of the robots can meet this constraint, whatever the solver does.

    Args:
        constraint: name of the binding constraint, e.g. ``connection``.
        where: pair, robot or obstacle, and sub-period.
        bound: the best value any motion can reach.
        required: the value the mission asks for.
        unit: of both.
        reason: the argument, in words.
    """

    def __init__(self, constraint: str, where: str, bound: float, required: float, unit: str, reason: str) -> None:
        self.constraint, self.where, self.bound, self.required, self.unit = constraint, where, bound, required, unit
        unit = f" {unit}" if unit else ""
        super().__init__(f"{constraint} ({where}): at best {bound:.4g}{unit}, required {required:.4g}{unit}: {reason}")


class NoFeasiblePlan(PlannerError):
    """The search ended without a plan that meets every limit.

    Args:
        outcome: status, and every violation of the best motion found.
    """

    def __init__(self, outcome: SolveOutcome) -> None:
        self.outcome = outcome
        worst = "; ".join(str(violation) for violation in outcome.violations[:3])
        super().__init__(f"{outcome.status.value}: {worst}" if worst else outcome.status.value)


class CertificateFailed(PlannerError):
    """What would fly misses the mission's limits.

    Args:
        certificate: every check, the failed ones among them.
    """

    def __init__(self, certificate: Certificate) -> None:
        self.certificate = certificate
        failed = certificate.failures
        shown = "; ".join(
            f"{check.name} {check.value:.4g} {check.unit} (limit {check.limit:.4g}) {check.where}".rstrip()
            for check in failed[:3]
        )
        super().__init__(f"{len(failed)} checks of the encoded trajectories failed: {shown}")
