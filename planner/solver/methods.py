"""The solvers behind one seam: Problem and settings in, SolveOutcome out, the same progress and interruption."""

from __future__ import annotations

from collections.abc import Callable

from missions.schema import SolverSettings
from planner.plan import Plan
from planner.problem import Problem
from planner.solver.imec import solve as imec
from planner.solver.result import Progress, SolveOutcome
from planner.solver.solve import solve as fast


def solve(
    problem: Problem,
    settings: SolverSettings,
    *,
    progress: Callable[[Progress], None] | None = None,
    initial: Plan | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> SolveOutcome:
    """Search for a plan with the method the settings name.

    Args:
        problem: what to solve.
        settings: method, seed, time limit.
        progress: called while it goes on.
        initial: plan of the same robots and steps to start from.
        should_stop: asked before every iteration; True ends the search with the best plan so far.

    Returns:
        The outcome; its plan is None unless every limit of the problem is met.
    """
    method = imec.solve if settings.method == "imec" else fast
    return method(problem, settings, progress=progress, initial=initial, should_stop=should_stop)
