"""Stage 2 of 7: a mission as an optimal control problem.

minimise  r_E log10 E(q) + ½ R mean_t uᵀu   subject to dynamics, rest at both ends, and g(q, v, u) ≤ 0   (IMEC, Eq. 9)

The logarithm of E keeps its pull as E falls over orders of magnitude. Limits are tightened by :class:`Margins`, because
the polynomials that fly deviate a little from the plan and still have to meet the mission's limits exactly.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from missions import fleet
from missions.arrays import Array
from missions.dynamics import DoubleIntegratorModel
from missions.schema import Mission
from planner.clearances import clearances, envelope, looks_between
from planner.coarser import RACE, coarser
from planner.connections import connections
from planner.constraints.base import Constraint
from planner.constraints.paths import When
from planner.dynamics import Dynamics
from planner.ergodic.metric import Metric
from planner.indicators import ergodic_metric
from planner.margins import Margins as Margins
from planner.models import control_bounds, has_mass, mission_dynamics


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
        coarse: the same problem with longer steps, or if those are too long looked at less closely, to begin the
            search with; None if that would be no cheaper. It may have one itself, to choose where to begin. Of a model
            written as expressions, whose controls change velocities: the same of a point mass.
        modes: of controls, at most; None: as many as the solver takes.
    """

    dynamics: Dynamics
    metric: Metric
    constraints: tuple[Constraint, ...]
    preferences: tuple[Constraint, ...]
    dt: float
    control_weight: float
    ergodic_weight: float = 1.0
    ends: Array | None = None
    coarse: Problem | None = None
    modes: int | None = None

    @property
    def steps(self) -> int:
        """T."""
        return self.dynamics.controls_shape[0]


def build_problem(
    mission: Mission, margins: Margins | None = None, *, coarse: bool = True, modes: int | None = None
) -> Problem:
    """The mission's problem with limits tightened by ``margins`` (default: ``Margins()``).

    Args:
        mission: what is asked for.
        margins: how much more is planned.
        coarse: whether to add the same problem as a search begins with it.
        modes: of controls, at most; None: as many as the solver takes.
    """
    margins = Margins() if margins is None else margins
    problem = _problem(mission, margins)
    return replace(problem, coarse=_coarse(mission, margins, problem) if coarse else None, modes=modes)


def _coarse(mission: Mission, margins: Margins, problem: Problem) -> Problem | None:
    """With steps twice as long, or where they are too long for that with a look at samples only; or of a point mass."""
    if has_mass(problem.dynamics):
        return _problem(replace(mission, dynamics=DoubleIntegratorModel()), margins, when=When.SAMPLES)
    half = coarser(mission)
    if half is None and not looks_between(problem.constraints):
        return None
    if half is None:
        return _problem(mission, margins, when=When.SAMPLES)
    quarter = coarser(half, RACE)
    # Along chords: between samples that are twice as far apart robots slip past each other.
    roughest = None if quarter is None else _problem(quarter, margins, when=When.CHORDS)
    return replace(_problem(half, margins, when=When.CHORDS), coarse=roughest)


def _problem(mission: Mission, margins: Margins, *, when: When | None = None) -> Problem:
    dynamics = mission_dynamics(mission)
    ends = fleet.ends(mission)
    policy = connections(mission, margins, dynamics)
    return Problem(
        dynamics=dynamics,
        metric=ergodic_metric(mission),
        constraints=(
            *clearances(mission, margins, when=when),
            *control_bounds(mission, envelope(mission, margins)),
            *policy.required,
        ),
        preferences=policy.preferred,
        dt=mission.horizon.dt,
        control_weight=mission.solver.control_weight,
        ends=None if np.isnan(ends).all() else ends,
    )
