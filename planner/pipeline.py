"""Stages 2 to 4 in one call: mission → plan → polynomials → bytes → certificate.

The planner works with slightly tightened limits because what flies deviates a little from the plan. How much is
enough depends on the mission, so the loop closes on the certificate: where the bytes miss a limit, the margin that
guards it grows by what was missed and the solver goes on from the plan it has. Where polynomials cannot follow long
steps, it goes on with shorter ones.
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
from planner.finer import FEWEST, SMOOTHER, at_steps, finer, joint_modes, smooth_modes, smoother
from planner.flightplan import FlightPlan
from planner.plan import Plan
from planner.problem import Margins, Problem, build_problem
from planner.slow import slow_points
from planner.solver.methods import solve
from planner.solver.result import Progress
from planner.trajectory.encode import decode, encode
from planner.trajectory.encoded import EncodedTrajectory
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.fit import fit
from planner.transfer.plan import plan_approach, plan_transfers
from planner.transfers import Transfers

ROUNDS = 5  # plans that are made before we say that none can be certified
NUDGE = 0.005  # [m] taken off the range when contacts are too short
STIFFER = 0.05  # share of the acceleration limit given up when polynomials cannot follow the plan within it


@dataclass(frozen=True)
class Ask:
    """What the solver is asked for.

    Attributes:
        grid: the mission, maybe with shorter steps. margins: how much tighter. modes: of the controls, if not free.
    """

    grid: Mission
    margins: Margins
    modes: int | None = None

    def problem(self) -> Problem:
        """The optimal control problem."""
        return build_problem(self.grid, self.margins, modes=self.modes)


@dataclass(frozen=True)
class Attempt:
    """One round: the plan, its bytes, the moves around it, what the certificate says of them."""

    plan: Plan
    trajectories: Mapping[str, EncodedTrajectory]
    transfers: Transfers
    certificate: Certificate


def make_flight_plan(
    mission: Mission,
    *,
    initial: Plan | None = None,
    progress: Callable[[Progress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> FlightPlan:
    """Plan, fit, encode and certify.

    Plans of the reference method end in motion; the default method takes them on from there and brings them to rest.

    Args:
        mission: what is asked for.
        initial: a plan of this mission, e.g. one that was picked from a front: it flies as it is if its bytes pass, and
            else is where the search begins.
        progress: called while it goes on.
        should_stop: asked before every iteration; True ends the search with the best plan so far.

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
    if initial is not None and (as_it_is := _certified(mission, initial)) is not None:
        return as_it_is
    ask, settings = Ask(mission, Margins(), joint_modes(mission)), replace(mission.solver, method="fast")
    if mission.solver.method != "fast" and initial is None:
        reference = solve(ask.problem(), mission.solver, progress=progress, should_stop=should_stop)
        initial = reference.plan
        if initial is None:
            raise NoFeasiblePlan(reference)
    for _ in range(ROUNDS):
        outcome = solve(ask.problem(), settings, progress=progress, initial=initial, should_stop=should_stop)
        if outcome.plan is None:
            raise NoFeasiblePlan(outcome)
        initial = _continued(outcome.plan, initial)
        try:
            attempt = _realise(mission, initial)
        except TrajectoryError as error:
            failure: PlannerError = error
            ask = _easier_to_follow(mission, ask)
            continue
        if attempt.certificate.passed:
            return _flight_plan(mission, attempt)
        failure = CertificateFailed(attempt.certificate)
        ask = _tightened(mission, ask, attempt)
    raise failure


def _certified(mission: Mission, plan: Plan) -> FlightPlan | None:
    """The flight of a plan as it is; None if its bytes miss a limit, or polynomials cannot follow it."""
    try:
        attempt = _realise(mission, plan)
    except TrajectoryError:
        return None
    return _flight_plan(mission, attempt) if attempt.certificate.passed else None


def _flight_plan(mission: Mission, attempt: Attempt) -> FlightPlan:
    plan = at_steps(attempt.plan, mission)
    return FlightPlan(mission, plan, attempt.trajectories, attempt.certificate, versions(), attempt.transfers)


def _easier_to_follow(mission: Mission, ask: Ask) -> Ask:
    """After a plan that bends more than polynomials can follow: shorter steps, or room below the acceleration limit."""
    fine = finer(mission) if ask.modes is None else None
    if fine is not None:
        return replace(ask, grid=fine, modes=smooth_modes(mission))
    return replace(ask, margins=replace(ask.margins, acceleration=ask.margins.acceleration + STIFFER))


def _tightened(mission: Mission, ask: Ask, attempt: Attempt) -> Ask:
    """After bytes that miss a limit: more margin, or shorter steps where no margin guards what is missed.

    Raises:
        CertificateFailed: neither will help.
    """
    missed = {check.name for check in attempt.certificate.failures}
    if "switch jump" in missed:
        missed -= {"switch jump", "upload in flight"}  # robots that slow down there get other legs
    unguarded = not missed <= _GUARDS.keys()
    if unguarded and mission.replanning.joints and ask.modes is not None:
        return replace(ask, modes=max(FEWEST, round(SMOOTHER * ask.modes)))
    short = finer(mission) is None
    if unguarded and short and missed - _GUARDS.keys() <= _SHAKES and (modes := smoother(mission, ask.modes)):
        return replace(ask, modes=modes)
    if unguarded and (ask.modes is not None or short):
        raise CertificateFailed(attempt.certificate)
    if unguarded:
        return _easier_to_follow(mission, ask)
    margins = grown(ask.margins, attempt.certificate)
    slow = slow_points(mission, switches(mission, attempt.trajectories))
    return replace(ask, margins=replace(margins, slow=margins.slow + slow))


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


def _realise(mission: Mission, plan: Plan) -> Attempt:
    pieces = fit(plan, mission)
    names = [robot.name for robot in mission.robots]
    joints = mission.replanning.joints
    encoded = {name: encode(p, mission.trajectory, joints) for name, p in zip(names, pieces, strict=True)}
    transfers = plan_transfers(mission, {name: decode(item) for name, item in encoded.items()})
    return Attempt(plan, encoded, transfers, certify(mission, encoded, transfers))


# Which margin guards which check, and how a miss in the check's unit becomes margin: the check's value and limit to
# what is added. A third is added on top, so that a miss does not take many rounds to close.
_GUARDS: Mapping[str, tuple[str, Callable[[Check], float]]] = {
    "separation": ("separation", lambda check: check.limit - check.value),
    "separation off time": ("separation", lambda check: check.limit - check.value),
    "obstacles": ("obstacle", lambda check: check.limit - check.value),
    "keep-out zones": ("obstacle", lambda check: check.limit - check.value),
    "landing obstacles": ("obstacle", lambda check: check.limit - check.value),
    "landing separation": ("separation", lambda check: check.limit - check.value),
    "stand-off": ("obstacle", lambda check: check.value - check.limit),
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


# What motors are asked for beyond their limits where accelerations change too fast: nothing else depends on snap.
_SHAKES = frozenset({"motor thrust", "least motor thrust", "roll and pitch rate"})


def grown(margins: Margins, certificate: Certificate) -> Margins:
    """Margins with what the certificate missed on top; of several misses that one margin guards, the largest."""
    growth: dict[str, float] = {}
    for check in certificate.failures:
        if check.name not in _GUARDS:
            continue  # switch jumps: robots slow down where they are too large, and only there
        name, missed = _GUARDS[check.name]
        growth[name] = max(growth.get(name, 0.0), 4.0 / 3.0 * missed(check))
    return replace(margins, **{name: getattr(margins, name) + more for name, more in growth.items()})
