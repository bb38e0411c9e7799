"""Stage 4 of 7: the plan to polynomials of degree 7.

For every robot the fewest pieces that stay close to the plan, with knots where the error is (search.py), each set of
knots fitted by least squares under the acceleration limit in continuous time (regression.py). The plan is followed
between its samples too, so the deviation is time-synchronised and holds in between.

How close is a trade. Deviation is paid for in margins, because whatever polynomials stray the planner has to keep in
reserve; pieces are paid for in bytes and time of upload only, up to the 31 that the memory holds. Two robots that stay
within 2 mm of their plans cannot use up the 4 mm of separation that the planner keeps in reserve (planner/margins.py),
so :data:`AIM` of the default tolerance of 1 cm is aimed at. Measured on the plans of the 13 shipped missions, with the
default margins: aims of 1, 2, 3.5, 5 and 10 mm take 26.6, 21.8, 18.1, 16.1 and 13.3 pieces a robot, and 13, 13, 13, 11
and 9 of the plans are certified at once. Where the memory is full first, anything up to the tolerance is taken: legs
that are uploaded in flight cost more than millimetres.

Speed is not constrained here: it follows from deviation and acceleration, and stays within the planner's margin of
1.5 % (on the same plans at most 0.9 % faster than planned).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from missions import fleet
from missions.arrays import Array
from missions.schema import FixedYaw, Mission
from planner.plan import Plan
from planner.trajectory.bezier import control_points
from planner.trajectory.compressed import rounded
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.knots import SHORTEST, most_pieces, place_knots, through
from planner.trajectory.motion import plan_motion
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.trajectory.poly4d import MAX_PIECES
from planner.trajectory.regression import Bound, Fit, fit_motion
from planner.trajectory.search import fewest_pieces
from planner.trajectory.spline import derivative_points
from planner.trajectory.yaw import heading

AIM = 0.2  # share of the tolerance that is aimed at
_CHECKS_PER_STEP = 10
_GUESS = 1.5  # [s] mean piece length to begin with
_COMPRESSED_SHORTEST = 0.4  # [s] millimetres rounded over shorter pieces shake the acceleration
_COMPRESSED_ROUNDS = 8
_MORE = 1.2  # room given to a shaken piece, in what it shakes
_LEAST_CAP = 0.5  # share of the limit that a piece keeps
_ROUNDED_START = 0.005  # share of the acceleration limit
_YAW_ROUNDING = 0.03  # share of the yaw rate's limit that tenths of a degree may take


def fit(plan: Plan, mission: Mission, start: Array | None = None) -> tuple[PiecewisePolynomial, ...]:
    """Polynomials of all robots, in the mission's order.

    x and y (and z of a 3-D workspace) follow the plan; z of a 2-D workspace is the flight's altitude; yaw is what the
    mission asks for, on the same knots, within its rate limit. A piece ends at each joint of a mission that may be
    planned anew.

    Args:
        plan: of the whole search, or of its end.
        mission: whose.
        start: (N, axes, 4) position, velocity, acceleration and jerk that a plan of the end begins with; None: at rest.

    Raises:
        TrajectoryError: a robot's plan cannot be followed within the tolerance and the acceleration limit, or leaves
            what the encoding can hold.
    """
    since = mission.horizon.duration - float(plan.t[-1])
    joints = tuple(joint - since for joint in mission.replanning.joints if joint > since + 0.5 * plan.dt)
    robots = range(plan.q.shape[1])
    return tuple(
        _fit_robot(plan, mission, robot, _Demands(joints, None if start is None else start[robot])) for robot in robots
    )


def deviation(plan: Plan, robot: int, trajectory: PiecewisePolynomial) -> tuple[float, float]:
    """Largest distance between plan and trajectory at the same time [m], and when [s].

    Sampled at ten times a step: both are smooth on that scale.
    """
    t = np.linspace(0.0, float(plan.t[-1]), _CHECKS_PER_STEP * (len(plan.t) - 1) + 1)
    axes = plan.q.shape[2]
    error = np.linalg.norm(trajectory.evaluate(t)[:, :axes] - plan_motion(plan, robot, t), axis=1)
    worst = int(np.argmax(error))
    return float(error[worst]), float(t[worst])


@dataclass(frozen=True)
class _Demands:
    """What polynomials have to do besides staying near the plan.

    Attributes:
        joints: when a piece has to end [s]. start: (axes, 4) derivatives to begin with; None: those of a rest.
    """

    joints: tuple[float, ...] = ()
    start: Array | None = None


@dataclass(frozen=True)
class _Candidate:
    """One fit and how good it is.

    Attributes:
        trajectory: what the fit gave, not rounded.
        deviation: of its bytes from the plan [m]. time: when it is that much [s].
        excesses: (M,) acceleration of its bytes over the limit [m/s²], by piece.
    """

    trajectory: PiecewisePolynomial
    deviation: float
    time: float
    excesses: Array

    @property
    def excess(self) -> float:
        """Largest excess [m/s²]."""
        return float(self.excesses.max())


def _fit_robot(plan: Plan, mission: Mission, robot: int, demands: _Demands) -> PiecewisePolynomial:
    """The first of the ways the encoding allows that keeps tolerance and limit: one memory first, then legs."""
    tolerance = mission.trajectory.tolerance
    # What is given to begin with was rounded, and may be over the limit already by as much.
    allowed = 0.0 if demands.start is None else _ROUNDED_START * float(fleet.accelerations(mission)[robot])
    failed: list[_Candidate] = []
    for way in _ways(plan, mission):
        candidate = way(plan, mission, robot, demands)
        if candidate.deviation <= tolerance and candidate.excess <= allowed:
            return candidate.trajectory
        failed.append(candidate)
    raise TrajectoryError(_why_not(mission, robot, min(failed, key=_shortfall)))


def _ways(plan: Plan, mission: Mission) -> Iterator[Callable[[Plan, Mission, int, _Demands], _Candidate]]:
    """What may become of the plan in the wanted encoding, best first; of what may be planned anew, always legs."""
    if mission.replanning.joints:
        yield _millimetres
        return
    encoding, most = mission.trajectory.encoding, most_pieces(float(plan.t[-1]))
    if encoding != "compressed":
        yield functools.partial(_float32, most=min(MAX_PIECES, most))
    if encoding == "poly4d" and most > MAX_PIECES:
        yield functools.partial(_float32, most=most)
    if encoding != "poly4d":
        yield _millimetres


def _float32(plan: Plan, mission: Mission, robot: int, demands: _Demands, most: int) -> _Candidate:
    """For poly4d, whose rounding is below a micrometre."""
    found = _search(plan, mission, robot, demands, most, SHORTEST)
    trajectory = _trajectory(plan, mission, robot, found)
    return _candidate(plan, mission, robot, trajectory, trajectory)


def _millimetres(plan: Plan, mission: Mission, robot: int, demands: _Demands) -> _Candidate:
    """For the compressed encoding: what it rounds counts, so pieces that it shakes get room below the limit.

    Raises:
        TrajectoryError: it leaves what the encoding can hold.
    """
    limit = float(fleet.accelerations(mission)[robot])
    most = most_pieces(float(plan.t[-1]), _COMPRESSED_SHORTEST)
    found = _search(plan, mission, robot, demands, most, _COMPRESSED_SHORTEST)
    caps = np.full(found.pieces, limit)
    motion = functools.partial(plan_motion, plan, robot)
    candidates: list[_Candidate] = []
    for _ in range(_COMPRESSED_ROUNDS):
        trajectory = _trajectory(plan, mission, robot, found)
        candidate = _candidate(plan, mission, robot, trajectory, rounded(trajectory))
        candidates.append(candidate)
        if candidate.excess <= 0.0:
            break
        caps = np.maximum(caps - _MORE * candidate.excesses, _LEAST_CAP * limit)
        found = fit_motion(motion, found.spline.knots, Bound(2, caps), start=demands.start)
    return min(candidates, key=_shortfall)


def _search(plan: Plan, mission: Mission, robot: int, demands: _Demands, most: int, shortest: float) -> Fit:
    """The fewest pieces, at most this many, that meet the aim; or what comes closest."""
    motion = functools.partial(plan_motion, plan, robot)
    bound = Bound(2, float(fleet.accelerations(mission)[robot]))
    guess = max(2, min(most, round(float(plan.t[-1]) / _GUESS)))
    knots = place_knots(plan, robot, guess, shortest)

    def attempt(knots: Array, aim: float | None) -> Fit:
        return fit_motion(motion, through(knots, demands.joints), bound, aim, demands.start)

    return fewest_pieces(attempt, knots, AIM * mission.trajectory.tolerance, most, shortest)


def _trajectory(plan: Plan, mission: Mission, robot: int, found: Fit) -> PiecewisePolynomial:
    """All four axes."""
    axes = len(found.unknowns)
    coefficients = np.zeros((found.pieces, 4, 8))
    coefficients[:, :axes] = found.spline.coefficients(found.unknowns)
    if axes == 2:
        coefficients[:, 2, 0] = fleet.altitudes(mission)[robot]
    settings = mission.trajectory
    if isinstance(settings.yaw, FixedYaw):
        coefficients[:, 3, 0] = settings.yaw.angle
    else:
        way = functools.partial(plan_motion, plan, robot)
        wanted = heading(way, float(plan.t[-1]), settings.yaw, settings.yaw_rate)
        turned = fit_motion(wanted, found.spline.knots, Bound(1, (1.0 - _YAW_ROUNDING) * settings.yaw_rate))
        coefficients[:, 3:] = turned.spline.coefficients(turned.unknowns)
    return PiecewisePolynomial(found.spline.durations, coefficients)


def _candidate(
    plan: Plan, mission: Mission, robot: int, trajectory: PiecewisePolynomial, flown: PiecewisePolynomial
) -> _Candidate:
    """Judge a trajectory by what would fly."""
    limit = float(fleet.accelerations(mission)[robot])
    points = control_points(flown.coefficients[:, : mission.dimension], flown.durations)
    acceleration = np.abs(points @ derivative_points(2, 2).T / flown.durations[:, None, None] ** 2)
    excesses = np.maximum(acceleration.max(axis=(1, 2)) - limit, 0.0)
    return _Candidate(trajectory, *deviation(plan, robot, flown), excesses)


def _shortfall(candidate: _Candidate) -> tuple[float, float]:
    """What counts when nothing meets limit and tolerance: first the limit."""
    return candidate.excess, candidate.deviation


def _why_not(mission: Mission, robot: int, best: _Candidate) -> str:
    """One line about a plan that polynomials cannot follow."""
    name, limit = mission.robots[robot].name, fleet.accelerations(mission)[robot]
    return (
        f"robot {name}: {best.trajectory.pieces} pieces within |a| <= {limit:g} m/s² deviate "
        f"{best.deviation * 1e3:.1f} mm from the plan at t = {best.time:.2f} s and miss the acceleration limit by "
        f"{best.excess:.2g} m/s²; allowed are {mission.trajectory.tolerance * 1e3:g} mm and 0 "
        f"(a plan that bends less near its limits is easier to follow)"
    )
