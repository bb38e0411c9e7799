"""Stages 2 to 4 in one call: mission → plan → polynomials → bytes → certificate.

The planner works with slightly tightened limits because what flies deviates a little from the plan. How much is
enough depends on the mission, so the loop closes on the certificate: where the bytes miss a limit, the margin that
guards it grows by what was missed and the solver goes on from the plan it has.
"""

from __future__ import annotations

import importlib.metadata
import platform
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from missions import fleet
from missions.dynamics import flies
from missions.schema import Mission
from planner.certificate.certify import certify
from planner.certificate.record import Certificate, Check
from planner.certificate.switching import switches
from planner.errors import CertificateFailed, NoFeasiblePlan, NotFlyableError, PlannerError
from planner.feasibility import check_feasible
from planner.flightplan import FlightPlan
from planner.plan import Plan
from planner.problem import Margins, build_problem
from planner.slow import slow_points
from planner.solver.methods import solve
from planner.solver.result import Progress
from planner.trajectory.encode import decode, encode
from planner.trajectory.encoded import EncodedTrajectory
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.fit import fit
from planner.transfer.plan import plan_approach, plan_transfers
from planner.transfers import Transfers

ROUNDS = 4  # how often margins may grow before we say that the plan cannot be certified
NUDGE = 0.005  # [m] taken off the range when contacts are too short
STIFFER = 0.05  # share of the acceleration limit given up when polynomials cannot follow the plan within it


@dataclass(frozen=True)
class Attempt:
    """One round: the plan, its bytes, the moves around it, what the certificate says of them."""

    plan: Plan
    trajectories: Mapping[str, EncodedTrajectory]
    transfers: Transfers
    certificate: Certificate
    margins: Margins


def make_flight_plan(
    mission: Mission,
    *,
    progress: Callable[[Progress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> FlightPlan:
    """Plan, fit, encode and certify.

    Plans of the reference method end in motion; the default method takes them on from there and brings them to rest.

    Raises:
        NotFlyableError: the mission's dynamics are for studies.
        UnreachableError: the mission is provably impossible; names the binding constraint.
        NoFeasiblePlan: the solver found no feasible plan; carries the outcome with every violation.
        CertificateFailed: the bytes miss the mission's limits even with grown margins; carries the certificate.
        TrajectoryError: the plan cannot be followed by polynomials that fit into the memory.
        TransferError: a robot has no safe way to its start or back.
    """
    if not flies(mission.dynamics):
        raise NotFlyableError(mission.dynamics.type)
    check_feasible(mission)
    plan_approach(mission, fleet.in_space(mission, fleet.starts(mission)))  # before the search is: it takes no time
    margins, settings = Margins(), mission.solver
    initial: Plan | None = None
    if settings.method != "fast":
        reference = solve(build_problem(mission, margins), settings, progress=progress, should_stop=should_stop)
        initial, settings = reference.plan, replace(settings, method="fast")
        if initial is None:
            raise NoFeasiblePlan(reference)
    for _ in range(ROUNDS):
        outcome = solve(
            build_problem(mission, margins),
            settings,
            progress=progress,
            initial=initial,
            should_stop=should_stop,
        )
        if outcome.plan is None:
            raise NoFeasiblePlan(outcome)
        initial = _continued(outcome.plan, initial)
        try:
            attempt = _realise(mission, initial, margins)
        except TrajectoryError as error:  # the plan bends more than the polynomials can follow within the limits
            failure: PlannerError = error
            margins = replace(margins, acceleration=margins.acceleration + STIFFER)
            continue
        if attempt.certificate.passed:
            return FlightPlan(
                mission, attempt.plan, attempt.trajectories, attempt.certificate, versions(), attempt.transfers
            )
        failure = CertificateFailed(attempt.certificate)
        margins = _grown(margins, attempt.certificate)
        margins = replace(margins, slow=margins.slow + slow_points(mission, switches(mission, attempt.trajectories)))
    raise failure


def _continued(plan: Plan, before: Plan | None) -> Plan:
    """The plan with what was spent on the one it started from."""
    if before is None:
        return plan
    return replace(plan, evaluations=plan.evaluations + before.evaluations, seconds=plan.seconds + before.seconds)


def versions() -> dict[str, str]:
    """Versions of what made a plan, for its provenance."""
    names = ("ergoflie", "numpy", "cflib")
    found = {name: importlib.metadata.version(name) for name in names}
    return {**found, "python": platform.python_version()}


def _realise(mission: Mission, plan: Plan, margins: Margins) -> Attempt:
    pieces = fit(plan, mission)
    names = [robot.name for robot in mission.robots]
    encoded = {name: encode(p, mission.trajectory) for name, p in zip(names, pieces, strict=True)}
    transfers = plan_transfers(mission, {name: decode(item) for name, item in encoded.items()})
    return Attempt(plan, encoded, transfers, certify(mission, encoded, transfers), margins)


# Which margin guards which check, and how a miss in the check's unit becomes margin: the check's value and limit to
# what is added. A third is added on top, so that a miss does not take many rounds to close.
_GUARDS: Mapping[str, tuple[str, Callable[[Check], float]]] = {
    "separation": ("separation", lambda check: check.limit - check.value),
    "separation off time": ("separation", lambda check: check.limit - check.value),
    "obstacles": ("obstacle", lambda check: check.limit - check.value),
    "keep-out zones": ("obstacle", lambda check: check.limit - check.value),
    "landing obstacles": ("obstacle", lambda check: check.limit - check.value),
    "landing separation": ("separation", lambda check: check.limit - check.value),
    "keep-in zones": ("workspace", lambda check: check.limit - check.value),
    "workspace": ("workspace", lambda check: check.limit - check.value),
    "speed": ("speed", lambda check: check.value / check.limit - 1.0),
    "acceleration": ("acceleration", lambda check: check.value / check.limit - 1.0),
    "connection probability": ("probability", lambda check: check.limit / check.value - 1.0),
    "same-time connection probability": ("probability", lambda check: check.limit / check.value - 1.0),
    "meeting": ("range", lambda check: check.value - check.limit),
    "rendezvous": ("range", lambda check: check.value - check.limit),
    "contact at all times": ("range", lambda check: check.value - check.limit),
    "contact": ("range", lambda _: NUDGE),  # seconds that are missing because of millimetres
}


def _grown(margins: Margins, certificate: Certificate) -> Margins:
    """Margins with what the certificate missed on top; of several misses that one margin guards, the largest.

    Raises:
        CertificateFailed: a check failed that no margin guards.
    """
    growth: dict[str, float] = {}
    for check in certificate.failures:
        if check.name == "switch jump":
            continue  # robots slow down where it is too large, and only there
        if check.name not in _GUARDS:
            raise CertificateFailed(certificate)
        name, missed = _GUARDS[check.name]
        growth[name] = max(growth.get(name, 0.0), 4.0 / 3.0 * missed(check))
    return replace(margins, **{name: getattr(margins, name) + more for name, more in growth.items()})
