"""The dynamics a mission asks for, and what bounds their controls."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from missions import fleet
from missions.dynamics import CasadiModel, SingleIntegratorModel
from missions.schema import Mission
from planner.constraints.acceleration import ControlBound
from planner.constraints.base import Constraint
from planner.constraints.control_box import ControlBox
from planner.dynamics import DoubleIntegrator, Dynamics, SingleIntegrator
from planner.dynamics.casadi_model import CasadiDynamics, casadi_dynamics


def mission_dynamics(mission: Mission) -> Dynamics:
    """The mission's model of motion, from its robots' starts.

    Raises:
        PlannerError: the model needs CasADi, which is not installed.
    """
    model, start = mission.dynamics, fleet.starts(mission)
    steps, dt = mission.steps, mission.horizon.dt
    if isinstance(model, SingleIntegratorModel):
        return SingleIntegrator(start, steps, dt)
    if isinstance(model, CasadiModel):
        return casadi_dynamics(model, start, steps, dt)
    velocity = fleet.velocities(mission)
    return DoubleIntegrator(start, steps, dt, velocity=velocity if np.any(velocity) else None)


def has_mass(dynamics: Dynamics) -> bool:
    """Whether a model written as expressions moves as a mass does: its controls change velocities but do not set them.

    Its searches begin with a point mass, an evaluation of which is cheaper, and go on from controls that follow it.
    """
    return isinstance(dynamics, CasadiDynamics) and dynamics.model.massive


def control_bounds(mission: Mission, envelope: Iterable[Constraint]) -> tuple[Constraint, ...]:
    """The envelope with the bounds of the model's own controls in place of those on accelerations."""
    model = mission.dynamics
    if not isinstance(model, SingleIntegratorModel | CasadiModel):
        return tuple(envelope)
    kept = tuple(item for item in envelope if not isinstance(item, ControlBound))
    if isinstance(model, SingleIntegratorModel):
        return kept  # the speed limit is the bound
    names = tuple(robot.name for robot in mission.robots)
    box = ControlBox(np.array(model.lower), np.array(model.upper), model.controls, names, mission.horizon.dt)
    return (*kept, box)
