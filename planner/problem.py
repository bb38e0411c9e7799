"""Stage 2 of 7: a mission as an optimal control problem.

minimise  r_E log10 E(q) + ½ R mean_t uᵀu   subject to dynamics, rest at both ends, and g(q, v, u) ≤ 0   (IMEC, Eq. 9)

The logarithm of E keeps its pull as E falls over orders of magnitude. Limits are tightened by :class:`Margins`, because
the polynomials that fly deviate a little from the plan and still have to meet the mission's limits exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions import fleet
from missions.arrays import Array
from missions.schema import Mission, ProbabilisticConnectivity
from planner.clearances import clearances, envelope
from planner.connectivity.pairs import all_pairs, sub_period_bounds
from planner.connectivity.quadrature import Quadrature, every_step, thinned
from planner.constraints.base import Constraint
from planner.constraints.connection import Connection
from planner.constraints.meeting import Meeting
from planner.dynamics import DoubleIntegrator, Dynamics
from planner.ergodic.metric import Metric
from planner.indicators import ergodic_metric
from planner.margins import Margins as Margins

NODE_SPACING = 0.6  # distance between nodes of connection probabilities at full speed, in R_c


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
        ends: (N, ν) where robots end, exactly [m]; NaN where they may end anywhere; None if all may.
    """

    dynamics: Dynamics
    metric: Metric
    constraints: tuple[Constraint, ...]
    preferences: tuple[Constraint, ...]
    dt: float
    control_weight: float
    ergodic_weight: float = 1.0
    ends: Array | None = None

    @property
    def steps(self) -> int:
        """T."""
        return self.dynamics.controls_shape[0]


def build_problem(mission: Mission, margins: Margins | None = None) -> Problem:
    """The mission's problem with limits tightened by ``margins`` (default: ``Margins()``)."""
    margins = Margins() if margins is None else margins
    dt = mission.horizon.dt
    velocity = fleet.velocities(mission)
    dynamics = DoubleIntegrator(
        fleet.starts(mission), mission.steps, dt, velocity=velocity if np.any(velocity) else None
    )
    ends = fleet.ends(mission)
    return Problem(
        dynamics=dynamics,
        metric=ergodic_metric(mission),
        constraints=(
            *clearances(mission, margins, dt / dynamics.substeps),
            *envelope(mission, margins),
            *_connection(mission, margins),
        ),
        preferences=_meetings(mission, margins),
        dt=dt,
        control_weight=mission.solver.control_weight,
        ends=None if np.isnan(ends).all() else ends,
    )


def _names(mission: Mission) -> tuple[str, ...]:
    return tuple(robot.name for robot in mission.robots)


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
    stride = int(NODE_SPACING * policy.range / (float(fleet.speeds(mission).max()) * mission.horizon.dt))
    return thinned(sub_period_bounds(mission.steps, policy.sub_periods), max(stride, 1))
