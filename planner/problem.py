"""Stage 2 of 7: a mission as an optimal control problem.

minimise  r_E log10 E(q) + ½ R mean_t uᵀu   subject to dynamics, rest at both ends, and g(q, v, u) ≤ 0   (IMEC, Eq. 9)

The logarithm of E keeps its pull as E falls over orders of magnitude. Limits are tightened by :class:`Margins`, because
the polynomials that fly deviate a little from the plan and still have to meet the mission's limits exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from missions.schema import Mission, ProbabilisticConnectivity
from planner.connectivity.pairs import all_pairs, sub_period_bounds
from planner.connectivity.quadrature import Quadrature, every_step, thinned
from planner.constraints.acceleration import ControlBound
from planner.constraints.base import Constraint
from planner.constraints.connection import Connection
from planner.constraints.meeting import Meeting
from planner.constraints.obstacles import Obstacles
from planner.constraints.separation import Separation
from planner.constraints.speed import Speed
from planner.constraints.workspace import Inside
from planner.dynamics import DoubleIntegrator, Dynamics
from planner.ergodic.metric import Metric
from planner.indicators import ergodic_metric

NODE_SPACING = 0.6  # distance between nodes of connection probabilities at full speed, in R_c


@dataclass(frozen=True)
class Margins:
    """How much tighter than the mission the planner plans.

    Attributes:
        separation: added to the distance between robots [m]; two robots deviate, hence about twice the others.
        obstacle: added to obstacles' radii [m]. workspace: taken off every side [m].
        acceleration: share taken off the acceleration limit. speed: share taken off the speed limit.
        probability: share added to the connection probability's threshold.
        range: taken off the communication range where robots have to meet [m].
    """

    separation: float = 0.008
    obstacle: float = 0.005
    workspace: float = 0.004
    acceleration: float = 0.05
    speed: float = 0.03
    probability: float = 0.01
    range: float = 0.005


@dataclass(frozen=True)
class Problem:
    """An optimal control problem, as data.

    Attributes:
        dynamics: from controls to motion. dt: step [s].
        metric: what is minimised (its logarithm).
        constraints: what has to hold.
        preferences: constraints that the search enforces too, but that a plan may miss: with the probabilistic policy
            a mission asks for P only, and pairs that truly meet are what P is meant to bring about.
        control_weight: R. ergodic_weight: r_E.
    """

    dynamics: Dynamics
    metric: Metric
    constraints: tuple[Constraint, ...]
    preferences: tuple[Constraint, ...]
    dt: float
    control_weight: float
    ergodic_weight: float = 1.0

    @property
    def steps(self) -> int:
        """T."""
        return self.dynamics.controls_shape[0]


def build_problem(mission: Mission, margins: Margins | None = None) -> Problem:
    """The mission's problem with limits tightened by ``margins`` (default: ``Margins()``)."""
    margins = Margins() if margins is None else margins
    dt = mission.horizon.dt
    start = np.array([robot.start[: mission.dimension] for robot in mission.robots], dtype=np.float64)
    dynamics = DoubleIntegrator(start, mission.steps, dt)
    return Problem(
        dynamics=dynamics,
        metric=ergodic_metric(mission),
        constraints=(
            *_clearances(mission, margins, start, dt / dynamics.substeps),
            *_envelope(mission, margins, start),
            *_connection(mission, margins),
        ),
        preferences=_meetings(mission, margins),
        dt=dt,
        control_weight=mission.solver.control_weight,
    )


def _names(mission: Mission) -> tuple[str, ...]:
    return tuple(robot.name for robot in mission.robots)


def _clearances(mission: Mission, margins: Margins, start: Array, dt_fine: float) -> tuple[Constraint, ...]:
    """Distances to keep. Margins never exceed the room at the start, which is given and where robots stand still."""
    constraints: list[Constraint] = []
    pairs = all_pairs(len(start))
    if len(pairs) and mission.limits.separation > 0.0:
        at_start = np.linalg.norm(start[pairs[:, 0]] - start[pairs[:, 1]], axis=-1)
        distance = np.minimum(mission.limits.separation + margins.separation, at_start)
        constraints.append(Separation(pairs, distance, _names(mission), dt_fine))
    if mission.obstacles:
        center = np.array([obstacle.center[:2] for obstacle in mission.obstacles], dtype=np.float64)
        radius = np.array([obstacle.radius for obstacle in mission.obstacles]) + margins.obstacle
        at_start = np.linalg.norm(start[:, None, :2] - center, axis=-1)
        constraints.append(Obstacles(center, np.minimum(radius, at_start), _names(mission), dt_fine))
    return tuple(constraints)


def _envelope(mission: Mission, margins: Margins, start: Array) -> tuple[Constraint, ...]:
    dt, names, limits = mission.horizon.dt, _names(mission), mission.limits
    lower = np.minimum(np.array(mission.workspace.lower) + margins.workspace, start)
    upper = np.maximum(np.array(mission.workspace.upper) - margins.workspace, start)
    u_max = limits.acceleration * (1.0 - margins.acceleration)
    return (
        Inside(lower, upper, names, dt),
        Speed(limits.speed * (1.0 - margins.speed), names, dt),
        ControlBound(u_max, names, dt, tolerance=0.01 * limits.acceleration),
    )


def _connection(mission: Mission, margins: Margins) -> tuple[Constraint, ...]:
    policy, pairs = mission.connectivity, all_pairs(len(mission.robots))
    if not isinstance(policy, ProbabilisticConnectivity) or len(pairs) == 0:
        return ()
    threshold = min(policy.threshold * (1.0 + margins.probability), 1.0)
    exact = every_step(sub_period_bounds(mission.steps, policy.sub_periods))
    return (Connection(policy.range, threshold, pairs, _nodes(mission, policy), exact, _names(mission)),)


def _meetings(mission: Mission, margins: Margins) -> tuple[Constraint, ...]:
    policy, pairs = mission.connectivity, all_pairs(len(mission.robots))
    if not isinstance(policy, ProbabilisticConnectivity) or len(pairs) == 0:
        return ()
    reach = max(policy.range - margins.range, 0.5 * policy.range)
    return (Meeting(reach, pairs, _nodes(mission, policy).nodes, _names(mission)),)


def _nodes(mission: Mission, policy: ProbabilisticConnectivity) -> Quadrature:
    """As few steps as the indicator's width allows at full speed."""
    stride = int(NODE_SPACING * policy.range / (mission.limits.speed * mission.horizon.dt))
    return thinned(sub_period_bounds(mission.steps, policy.sub_periods), max(stride, 1))
