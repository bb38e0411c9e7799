"""The same mission on coarse time grids, where most of a search is done for half the price.

To tell good starts from bad takes less than to go on from them: races begin on a grid that is coarser still.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from missions import fleet
from missions.connectivity import PeriodicConnectivity
from missions.schema import Mission
from missions.topology import rendezvous_steps, sub_period_steps


class Grid(NamedTuple):
    """How coarse a grid may be.

    Attributes:
        fewest: steps. farthest: step at full speed, in half wavelengths of the finest basis function.
    """

    fewest: int
    farthest: float


SEARCH, RACE = Grid(100, 1.0), Grid(50, 2.0)


def coarser(mission: Mission, grid: Grid = SEARCH) -> Mission | None:
    """The mission with steps twice as long; None if its own steps are as coarse as the grid may be.

    Sub-periods and rendezvous have to begin and end on the coarse grid, and a step at full speed must not jump over
    what the basis resolves.
    """
    marks = [edge for bounds in sub_period_steps(mission) for edge in bounds]
    if isinstance(mission.connectivity, PeriodicConnectivity):
        marks += rendezvous_steps(mission, mission.connectivity)
    if mission.steps < 2 * grid.fewest or any(step % 2 for step in (mission.steps, *marks)):
        return None
    box, functions = mission.workspace, mission.basis.functions_per_axis
    sides = [high - low for low, high in zip(box.lower, box.upper, strict=True)][: mission.information_axes]
    shortest = min(sides) / max(functions - 1, 1)
    dt = 2.0 * mission.horizon.dt
    if dt * float(fleet.speeds(mission).max()) > grid.farthest * shortest:
        return None
    return replace(mission, horizon=replace(mission.horizon, dt=dt))
