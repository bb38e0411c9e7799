"""Stages 3 and 4 for polynomials that are there already: bytes, moves around them, certificate.

Nothing is fitted and nothing is solved: the pieces are encoded as they come, so a trajectory that was exported from
poly4d bytes comes back as the same bytes. What the plan's samples say is derived from the bytes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from missions import fleet
from missions.arrays import Array
from missions.dynamics import flies
from missions.schema import Mission
from planner.certificate.certify import REST_LIMITS, certify
from planner.certificate.checks import DISTANCE_TOLERANCE
from planner.certificate.memory import DURATION_TOLERANCE, decoded
from planner.certificate.motion import largest_at_ends
from planner.errors import CertificateFailed, NotFlyableError
from planner.flightplan import FlightPlan
from planner.indicators import ergodic_metric
from planner.interchange.errors import InterchangeError
from planner.pipeline import versions
from planner.plan import Plan
from planner.trajectory.encode import encode
from planner.trajectory.piecewise import PiecewisePolynomial, concatenated
from planner.transfer.plan import plan_transfers

_LONGEST_HOLD = 60.0  # [s] of one piece that holds: the compressed format ends at 65.5 s
_UNITS = ("m/s", "m/s²")


def flight_plan_of(mission: Mission, trajectories: Mapping[str, PiecewisePolynomial]) -> FlightPlan:
    """A certified flight plan of given polynomials.

    Robots whose trajectory ends before the mission's horizon hold their last point until then.

    Args:
        mission: what is allowed; its robots, starts and horizon have to be those of the trajectories.
        trajectories: by robot name, in any order.

    Raises:
        NotFlyableError: the mission's dynamics are for studies.
        InterchangeError: a robot more or less; a trajectory that starts elsewhere, is not at rest at both ends, or
            lasts longer than the search.
        TrajectoryError: the bytes cannot hold it. TransferError: no safe way to the starts or back.
        CertificateFailed: what would fly misses the mission's limits; carries the certificate.
    """
    if not flies(mission.dynamics):
        raise NotFlyableError(mission.dynamics.type)
    whole = extended(mission, trajectories)
    encoded = {name: encode(trajectory, mission.trajectory) for name, trajectory in whole.items()}
    flown = {name: decoded(name, item) for name, item in encoded.items()}
    transfers = plan_transfers(mission, flown)
    certificate = certify(mission, encoded, transfers)
    if not certificate.passed:
        raise CertificateFailed(certificate)
    return FlightPlan(mission, sampled_plan(mission, flown), encoded, certificate, versions(), transfers)


def extended(mission: Mission, trajectories: Mapping[str, PiecewisePolynomial]) -> Mapping[str, PiecewisePolynomial]:
    """The trajectories in the mission's order, each followed by a hover until the search ends.

    Raises:
        InterchangeError: as :func:`flight_plan_of`.
    """
    names = [robot.name for robot in mission.robots]
    _check_names(names, trajectories)
    return {name: _whole(mission, robot, trajectories[name]) for robot, name in enumerate(names)}


def sampled_plan(mission: Mission, flown: Mapping[str, PiecewisePolynomial]) -> Plan:
    """Samples of trajectories as a plan, with controls that lead from velocity to velocity.

    Args:
        mission: whose steps and axes are sampled.
        flown: trajectories at rest at both ends, in the mission's order.

    Returns:
        A plan; its ``violation`` is NaN, for there was no planner's problem.
    """
    t: Array = np.arange(mission.steps + 1, dtype=np.float64) * mission.horizon.dt
    axes = mission.dimension
    q = np.stack([trajectory.evaluate(t)[:, :axes] for trajectory in flown.values()], axis=1)
    v = np.stack([trajectory.evaluate(t, 1)[:, :axes] for trajectory in flown.values()], axis=1)
    v[0] = v[-1] = 0.0
    u: Array = np.diff(v, axis=0) / mission.horizon.dt
    return Plan(t, q, v, u, ergodicity=ergodic_metric(mission).value(q[:-1]), violation=math.nan)


def _check_names(names: list[str], trajectories: Mapping[str, PiecewisePolynomial]) -> None:
    strangers = sorted(set(trajectories) - set(names))
    missing = [name for name in names if name not in trajectories]
    if strangers or missing:
        found = [f"none for {', '.join(missing)}"] * bool(missing) + [f"{name} is no robot of it" for name in strangers]
        raise InterchangeError(f"trajectories: {'; '.join(found)}; allowed: the mission's robots, {', '.join(names)}")


def _whole(mission: Mission, robot: int, trajectory: PiecewisePolynomial) -> PiecewisePolynomial:
    """The trajectory for the whole search, or why it is none."""
    name, horizon = mission.robots[robot].name, mission.horizon.duration
    with np.errstate(over="ignore", invalid="ignore"):  # numbers this large are refused as too far or too fast
        _check_start(mission, robot, trajectory)
        for order, (limit, unit) in enumerate(zip(REST_LIMITS, _UNITS, strict=True), start=1):
            rest = largest_at_ends(trajectory, order)
            if not rest.value <= limit:
                reason = f"got {rest.value:.3g} {unit} at t = {rest.time:g} s"
                raise InterchangeError(f"{name}: {reason}; allowed: rest at both ends, at most {limit:g} {unit}")
    spare = horizon - trajectory.duration
    if spare < -DURATION_TOLERANCE:
        raise InterchangeError(
            f"{name}: lasts {trajectory.duration:g} s; allowed: at most the mission's horizon.duration, {horizon:g} s"
        )
    return trajectory if spare <= DURATION_TOLERANCE else concatenated([trajectory, _hold(trajectory, spare)])


def _check_start(mission: Mission, robot: int, trajectory: PiecewisePolynomial) -> None:
    start = fleet.in_space(mission, fleet.starts(mission))[robot]
    first = trajectory.evaluate(np.zeros(1))[0, :3]
    if not np.linalg.norm(first - start) <= DISTANCE_TOLERANCE:
        allowed = f"allowed: robots[{robot}]'s start, {_show(start)} [m]"
        raise InterchangeError(f"{mission.robots[robot].name}: starts at {_show(first)}; {allowed}")


def _hold(trajectory: PiecewisePolynomial, duration: float) -> PiecewisePolynomial:
    """Pieces that stay where the trajectory ends."""
    pieces = math.ceil(duration / _LONGEST_HOLD)
    coefficients = np.zeros((pieces, 4, 8))
    coefficients[:, :, 0] = trajectory.evaluate(np.array([trajectory.duration]))[0]
    return PiecewisePolynomial(np.full(pieces, duration / pieces), coefficients)


def _show(point: Array) -> str:
    return f"({', '.join(f'{value:.6g}' for value in point)})"
