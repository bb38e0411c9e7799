"""Stage 4 of 7: the plan to polynomials of degree 7.

For every robot and axis

    minimise    ∫ (p − q)² + μ² (p̈ − q̈)² dt
    subject to  |p̈| <= u_max in continuous time (control points of p̈, every piece cut in four),
                p = q, ṗ = q̇ and p̈ = p⃛ = 0 at both ends,

over C³ splines of degree 7 whose knots lie where the plan's acceleration bends. q is the plan's motion between its
samples too, so the deviation is time-synchronised and holds in between.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from missions import fleet
from missions.arrays import Array
from missions.schema import Mission
from planner.plan import Plan
from planner.trajectory.bounded import bounded_least_squares
from planner.trajectory.encode import decode, encode
from planner.trajectory.encoded import MEMORY_SIZE
from planner.trajectory.errors import TrajectoryError
from planner.trajectory.knots import place_knots
from planner.trajectory.motion import plan_motion
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.trajectory.poly4d import MAX_PIECES
from planner.trajectory.spline import SepticSpline, differences

MU = 0.05  # [s²] weight of acceleration errors against position errors: faster changes than ~√μ are smoothed
AIM = 0.1  # share of the tolerance at which more pieces stop being worth it
_HEADROOM = 2e-4  # of the acceleration limit, for rounding and for the solver's own tolerance
_COARSEST = 2.0  # [s] mean piece length to begin with
_GROWTH = 1.5
_CHECKS_PER_STEP = 10
_COMPRESSED_SHORTEST = 0.7  # [s] millimetres rounded over shorter pieces shake the acceleration


def fit(plan: Plan, mission: Mission) -> tuple[PiecewisePolynomial, ...]:
    """Polynomials of all robots, in the mission's order.

    x and y (and z of a 3-D workspace) follow the plan; z of a 2-D workspace is the flight's altitude; yaw is zero.
    The number of pieces grows until the deviation is a tenth of the mission's tolerance or the memory is full.

    Raises:
        TrajectoryError: a robot's plan cannot be followed within the tolerance and the acceleration limit, or leaves
            what the encoding can hold.
    """
    return tuple(_fit_robot(plan, mission, robot) for robot in range(plan.q.shape[1]))


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
class _Candidate:
    """One fit and how good it is: deviation of its bytes [m] and when [s], acceleration over the limit [m/s²]."""

    trajectory: PiecewisePolynomial
    deviation: float
    time: float
    excess: float


def _fit_robot(plan: Plan, mission: Mission, robot: int) -> PiecewisePolynomial:
    """Fit with more and more pieces until the aim is reached; the best one wins."""
    tolerance = mission.trajectory.tolerance
    best: _Candidate | None = None
    for pieces, even in _piece_counts(plan, mission):
        try:
            candidate = _fit_pieces(plan, mission, robot, place_knots(plan, robot, pieces, even=even))
        except TrajectoryError as error:  # of the encoding; what was found before says more
            if best is None:
                raise TrajectoryError(f"robot {mission.robots[robot].name}: {error}") from None
            break
        if best is None or (candidate.excess, candidate.deviation) < (best.excess, best.deviation):
            best = candidate
        if best.excess <= 0 and best.deviation <= AIM * tolerance:
            break
        if pieces >= MAX_PIECES and mission.trajectory.encoding == "auto" and best.deviation <= tolerance:
            break  # float32 pieces are worth more than more pieces rounded to millimetres
    if best is None or best.excess > 0 or best.deviation > tolerance:
        raise TrajectoryError(_why_not(mission, robot, best))
    return best.trajectory


def _why_not(mission: Mission, robot: int, best: _Candidate | None) -> str:
    """One line about a plan that polynomials cannot follow."""
    name, limit = mission.robots[robot].name, fleet.accelerations(mission)[robot]
    if best is None:
        return f"robot {name}: the plan is too short for a polynomial"
    return (
        f"robot {name}: {best.trajectory.pieces} pieces within |a| <= {limit:g} m/s² deviate "
        f"{best.deviation * 1e3:.1f} mm from the plan at t = {best.time:.2f} s and miss the acceleration limit by "
        f"{best.excess:.2g} m/s²; allowed are {mission.trajectory.tolerance * 1e3:g} mm and 0 "
        f"(a plan that bends less near its limits is easier to follow)"
    )


def _piece_counts(plan: Plan, mission: Mission) -> Iterator[tuple[int, bool]]:
    """Numbers of pieces to try and whether to spread them evenly, within what the encoding holds."""
    end = float(plan.t[-1])
    encoding = mission.trajectory.encoding
    start = max(2, math.ceil(end / _COARSEST))
    if encoding != "compressed":
        count = min(start, MAX_PIECES)
        while count < MAX_PIECES:
            yield count, False
            count = math.ceil(count * _GROWTH)
        yield MAX_PIECES, False
    if encoding != "poly4d":
        bytes_a_piece = 3 + 14 * plan.q.shape[2]
        most = (MEMORY_SIZE - 8 - 3) // bytes_a_piece
        most = max(1, min(most, int(end / _COMPRESSED_SHORTEST)))
        count = start if encoding == "compressed" else MAX_PIECES + 1
        while count < most:
            yield count, True
            count = math.ceil(count * _GROWTH)
        yield most, True


def _fit_pieces(plan: Plan, mission: Mission, robot: int, knots: Array) -> _Candidate:
    """Fit one robot on given knots."""
    limit = float(fleet.accelerations(mission)[robot])
    spline = SepticSpline(knots)
    unknowns = 4 * len(knots)
    axes = plan.q.shape[2]
    t = _quadrature(plan)
    P, D = spline.at(t), spline.at(t, 2)
    A = _acceleration_rows(spline)
    inner = slice(4, unknowns - 4)
    x = np.zeros((unknowns, axes))
    x[0], x[-4] = plan.q[0, robot], plan.q[-1, robot]
    x[1], x[-3] = plan.v[0, robot] * spline.scale, plan.v[-1, robot] * spline.scale
    y, a = plan_motion(plan, robot, t) - P @ x, plan_motion(plan, robot, t, 2) - D @ x
    b = A @ x
    P, D, A = P[:, inner], D[:, inner], A[:, inner]
    H = P.T @ P + MU**2 * D.T @ D
    g = P.T @ y + MU**2 * D.T @ a
    for axis in range(axes):
        x[inner, axis] = bounded_least_squares(H, g[:, axis], A, b[:, axis], limit * (1 - _HEADROOM), limit * 1e-4)
    coefficients = np.zeros((len(knots) - 1, 4, 8))
    coefficients[:, :axes] = spline.coefficients(x)
    if axes == 2:
        coefficients[:, 2, 0] = fleet.altitudes(mission)[robot]
    trajectory = PiecewisePolynomial(spline.durations, coefficients)
    flown = decode(encode(trajectory, mission.trajectory))  # rounding counts: millimetres when compressed
    excess = max(0.0, float(np.abs(A @ x[inner] + b).max()) - limit)
    return _Candidate(trajectory, *deviation(plan, robot, flown), excess)


def _quadrature(plan: Plan) -> Array:
    """Two Gauss points in every planning step (2T,) [s]."""
    nodes = 0.5 + np.array([-0.5, 0.5]) / math.sqrt(3.0)
    return np.asarray(((np.arange(len(plan.t) - 1)[:, None] + nodes) * plan.dt).ravel())


def _acceleration_rows(spline: SepticSpline) -> Array:
    """(24 M, n) control points of the acceleration, every piece cut in four: they bound it closely."""
    points = differences(spline.points(), spline.durations, 2)  # (M, 6, n)
    rows: Array = np.einsum("sij,mjn->msin", _quarters(), points).reshape(-1, points.shape[-1])
    return rows


@functools.cache
def _quarters() -> Array:
    """(4, 6, 6) de Casteljau maps from control points of degree 5 to those of the four quarters."""
    left: Array = np.array([[math.comb(i, j) / 2.0**i for j in range(6)] for i in range(6)])
    right = left[::-1, ::-1]
    quarters: Array = np.stack([left @ left, right @ left, left @ right, right @ right])
    return quarters
