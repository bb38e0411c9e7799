"""From a point of a front to a flight: its weights written into the mission, its plan certified as bytes."""

from __future__ import annotations

from collections.abc import Callable

from missions.information import SeveralMaps
from missions.weights import rewritten
from planner.flightplan import FlightPlan
from planner.pareto.front import Front
from planner.pipeline import make_flight_plan
from planner.solver.result import Progress


def flight_plan_of(
    front: Front,
    pick: str,
    *,
    progress: Callable[[Progress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> FlightPlan:
    """The certified plan of a point.

    The plan that was picked is what flies, if its bytes pass; else the search goes on from it.

    Args:
        front: the plans to choose from.
        pick: index or name of one, see :attr:`Front.named`.
        progress: called if there has to be a search.
        should_stop: asked if there is.

    Raises:
        FrontError: no such point.
        PlannerError: as :func:`make_flight_plan`.
    """
    point, mission = front.find(pick), front.mission
    if isinstance(mission.information, SeveralMaps):
        mission = rewritten(mission, point.weights.tolist())
    return make_flight_plan(mission, initial=point.plan, progress=progress, should_stop=should_stop)
