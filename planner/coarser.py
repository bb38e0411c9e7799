"""The same mission on a coarse time grid, where most of a search is done for half the price."""

from __future__ import annotations

from dataclasses import replace

from missions import fleet
from missions.connectivity import PeriodicConnectivity
from missions.schema import Mission
from missions.topology import rendezvous_steps, sub_period_steps

FEWEST_STEPS = 100  # of the coarse grid
FARTHEST_STEP = 1.0  # at full speed, in half wavelengths of the finest basis function


def coarser(mission: Mission) -> Mission | None:
    """The mission with steps twice as long; None if its own steps are as coarse as the search allows.

    Sub-periods and rendezvous have to begin and end on the coarse grid, and a step at full speed must not jump over
    what the basis resolves.
    """
    marks = [edge for bounds in sub_period_steps(mission) for edge in bounds]
    if isinstance(mission.connectivity, PeriodicConnectivity):
        marks += rendezvous_steps(mission, mission.connectivity)
    if mission.steps < 2 * FEWEST_STEPS or any(step % 2 for step in (mission.steps, *marks)):
        return None
    box, functions = mission.workspace, mission.basis.functions_per_axis
    shortest = min(high - low for low, high in zip(box.lower, box.upper, strict=True)) / max(functions - 1, 1)
    dt = 2.0 * mission.horizon.dt
    if dt * float(fleet.speeds(mission).max()) > FARTHEST_STEP * shortest:
        return None
    return replace(mission, horizon=replace(mission.horizon, dt=dt))
