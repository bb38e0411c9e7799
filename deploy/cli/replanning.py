"""Who plans anew while drones fly: in the rehearsal's own process, or in one of its own beside a flight."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from deploy.replanner import Replanner
    from missions.schema import Mission
    from planner.flightplan import FlightPlan


def rehearsed() -> Replanner:
    """For rehearsals, whose clock stands meanwhile: as much work as it takes, the same every time."""
    from planner.replan.anew import replan

    return replan


@contextmanager
def beside(mission: Mission) -> Iterator[Replanner | None]:
    """For flights: a process of its own, so that the flight loop does not wait for it; None if nothing may change.

    Searches end with what they have after half the budget; what is late all the same is not flown.
    """
    if not mission.replanning.joints:
        yield None
        return
    from planner.replan.anew import Effort, replan

    effort = Effort(time_limit=0.5 * mission.replanning.budget)
    # Spawned: a forked copy of a process with radio threads may hang on a lock that nobody releases.
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        pool.submit(_imported).result()

        def elsewhere(current: FlightPlan, mission: Mission, joint: int) -> FlightPlan:
            return pool.submit(replan, current, mission, joint, effort=effort).result()

        yield elsewhere


def _imported() -> None:
    """Nothing; whoever has done it has imported what planning takes."""
    from planner.replan import anew

    del anew
