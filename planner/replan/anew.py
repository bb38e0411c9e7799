"""Planning the rest of a search anew, on another map, while its beginning is flown.

What has been flown is what it is, byte for byte; the rest begins with its position, velocity and acceleration, from the
plan there is, and is certified together with it: a plan that was changed in flight is a plan for the whole mission like
any other, and whoever looks at its bytes cannot tell.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from missions import fleet
from missions.arrays import Array
from missions.schema import Mission
from planner.certificate.certify import certify
from planner.errors import CertificateFailed, NoFeasiblePlan, PlannerError
from planner.finer import FEWEST, HALF_WAVES, SMOOTHER
from planner.flightplan import FlightPlan
from planner.margins import Margins, SlowPoint
from planner.pipeline import STIFFER, grown, versions
from planner.plan import Plan
from planner.replan.rest import rest_problem, whole_ergodicity
from planner.slow import SHARE, SLOWEST
from planner.solver import augmented_lagrangian as al
from planner.solver.search import Search, search_warm
from planner.trajectory.encode import decode, decode_leg
from planner.trajectory.encoded import EncodedTrajectory
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.fit import fit
from planner.trajectory.legs import legs_between
from planner.trajectory.piecewise import PiecewisePolynomial, concatenated
from planner.transfer.plan import plan_transfers

STIFF = 10.0  # by what the penalty of a search is larger when the one before met not every limit
ATTEMPTS = 4  # rests that are planned before there is none


@dataclass(frozen=True)
class Effort:
    """How much work a rest is worth; in rounds, not in time, so that the same question has the same answer.

    Attributes:
        rounds: of the augmented Lagrangian, at most.
        penalty: μ of the first one: soft enough to leave the old plan, stiff enough to be done soon.
        time_limit: wall time [s] after which a search ends with what it has; infinite: when it is done.
    """

    rounds: int = 120
    penalty: float = 3.0
    time_limit: float = np.inf


DEFAULT = Effort()


def planned_anew(
    mission: Mission,
    plan: Plan,
    step: int,
    *,
    start: Array | None = None,
    history: bool = True,
    effort: Effort = DEFAULT,
    margins: Margins | None = None,
    modes: int | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> Plan:
    """A plan that is the old one up to a step, and a new one for the mission's map from there.

    Args:
        mission: with the map that holds from now on.
        plan: of the same robots, for whatever map.
        step: where the new part begins.
        start: (N, ν, 3) position, velocity and acceleration there; default: the plan's own.
        history: whether what has been flown counts; not with a map from which it was taken off (:func:`consumed`).
        effort: how hard to search.
        margins: how much tighter than the mission to plan.
        modes: of the controls, at most; None: as many as the solver takes.
        should_stop: asked before every iteration; True ends the search with the best so far.

    Returns:
        The plan of the whole mission; E on the new map.

    Raises:
        NoFeasiblePlan: no rest that meets every limit was found.
        PlannerError: the step is not inside the plan, or the mission is none that this can be done for.
    """
    if not 0 <= step < len(plan.u):
        raise PlannerError(f"got step {step}; allowed: 0 to {len(plan.u) - 1}, inside the plan")
    if start is None:
        start = np.stack([plan.q[step], plan.v[step], plan.u[max(step - 1, 0)] * (step > 0)], axis=-1)
    flown = plan.q[:step] if history else None
    rest, problem = rest_problem(mission, step, start, flown, margins or Margins(), modes)
    settings = replace(rest.solver, time_limit=effort.time_limit)
    schedule = al.Schedule(penalty=effort.penalty, rounds=effort.rounds)
    search = Search(problem, settings, schedule, None, should_stop)
    outcome = search_warm(search, replace(plan, u=plan.u[step:]))
    if outcome.plan is None:
        raise NoFeasiblePlan(outcome)
    found = outcome.plan
    q = np.concatenate([plan.q[:step], found.q])
    return replace(
        found,
        t=plan.t,
        q=q,
        v=np.concatenate([plan.v[:step], found.v]),
        u=np.concatenate([plan.u[:step], found.u]),
        ergodicity=whole_ergodicity(mission, q[:-1]),
    )


def replan(
    current: FlightPlan,
    mission: Mission,
    joint: int,
    *,
    effort: Effort = DEFAULT,
    should_stop: Callable[[], bool] | None = None,
) -> FlightPlan:
    """The flight plan that takes over at a joint.

    Its legs before the joint are those of ``current``, byte for byte; the first one after it lies beside the one that
    it replaces, so that either can be started. Its certificate is for the whole of it.

    Args:
        current: what is flown.
        mission: the same with the map that holds from now on (:func:`missions.replanning.with_information`).
        joint: number of the mission's joint, from 0.
        effort: how hard to search.
        should_stop: asked before every iteration of the search.

    Raises:
        NoFeasiblePlan, CertificateFailed, TrajectoryError, TransferError: there is none, and why.
        PlannerError: there is no such joint.
    """
    joints = mission.replanning.joints
    if not 0 <= joint < len(joints):
        raise PlannerError(f"got joint {joint}; allowed: 0 to {len(joints) - 1}, as the mission has")
    flown = {name: _before(encoded, joint + 1) for name, encoded in current.trajectories.items()}
    states = np.stack([_end(polynomial, mission.dimension) for polynomial in flown.values()])  # (N, ν, 4)
    step = round(joints[joint] / mission.horizon.dt)
    margins, plan = _margins(mission), current.plan
    modes = max(FEWEST, round(HALF_WAVES * (mission.horizon.duration - joints[joint])))
    for _ in range(ATTEMPTS):
        try:
            plan = planned_anew(
                mission,
                plan,
                step,
                start=states[..., :3],
                effort=effort,
                margins=margins,
                modes=modes,
                should_stop=should_stop,
            )
            found = _certified(current, mission, plan, joint, flown, states)
        except NoFeasiblePlan as error:
            failure: PlannerError = error
            effort = replace(effort, penalty=STIFF * effort.penalty)
            continue
        except TrajectoryError as error:
            failure = error
            margins = replace(margins, acceleration=margins.acceleration + STIFFER)
            continue
        if found.certificate.passed:
            return found
        failure = CertificateFailed(found.certificate)
        margins, before = grown(margins, found.certificate), margins
        if margins == before:  # no margin guards what is missed: it shakes
            modes = max(FEWEST, round(SMOOTHER * modes))
    raise failure


def _certified(
    current: FlightPlan,
    mission: Mission,
    plan: Plan,
    joint: int,
    flown: Mapping[str, PiecewisePolynomial],
    states: Array,
) -> FlightPlan:
    """The whole flight with the rest of a plan in it, and what the certificate says of that."""
    joints, step = mission.replanning.joints, round(mission.replanning.joints[joint] / mission.horizon.dt)
    rest = replace(plan, t=plan.t[step:] - plan.t[step], q=plan.q[step:], v=plan.v[step:], u=plan.u[step:])
    later = [t - joints[joint] for t in joints[joint + 1 :]]
    trajectories = {}
    for (name, before), pieces in zip(flown.items(), fit(rest, mission, states), strict=True):
        legs = legs_between(pieces, later, before, joint + 1)
        trajectories[name] = EncodedTrajectory((*current.trajectories[name].legs[: joint + 1], *legs))
    transfers = plan_transfers(mission, {name: decode(item) for name, item in trajectories.items()})
    certificate = certify(mission, trajectories, transfers)
    return FlightPlan(mission, plan, trajectories, certificate, versions(), transfers)


def _margins(mission: Mission) -> Margins:
    """With what commands off time take counted at once: there is no time to be told by a certificate.

    Two at full speed, one early and one late, lose separation; whoever is fast at a joint jumps
    (``planner/certificate/switching.py``).
    """
    radio, speeds = mission.radio, fleet.speeds(mission)
    off_time = 2.0 * float(speeds.max()) * radio.jitter
    bend = fleet.accelerations(mission) * np.sqrt(mission.dimension)
    delay = 2.0 * radio.jitter
    allowed = np.maximum(SLOWEST, SHARE * (radio.switch_jump - 0.5 * bend * delay**2) / delay)
    slow = tuple(
        SlowPoint(int(robot), joint, float(allowed[robot]))
        for robot in np.flatnonzero(allowed < speeds)
        for joint in mission.replanning.joints
    )
    return replace(Margins(), separation=Margins().separation + off_time, slow=slow)


def _before(encoded: EncodedTrajectory, legs: int) -> PiecewisePolynomial:
    """What the first legs of a robot are, as it flies them."""
    return concatenated([decode_leg(leg) for leg in encoded.legs[:legs]])


def _end(polynomial: PiecewisePolynomial, axes: int) -> Array:
    """(axes, 4) position, velocity and acceleration at the end; jerk may jump, and zero bends the least."""
    h = polynomial.durations[-1:]
    last = PiecewisePolynomial(h, polynomial.coefficients[-1:])
    derivatives = [last.evaluate(h, order)[0, :axes] for order in range(3)]
    return np.stack([*derivatives, np.zeros(axes)], axis=-1)
