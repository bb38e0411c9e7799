"""Stage 3 of 7: Problem in, Plan out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from missions.schema import SolverSettings
from planner.plan import Plan
from planner.problem import Problem
from planner.solver import augmented_lagrangian as al
from planner.solver.parallel import solve_parallel
from planner.solver.result import Progress, SolveOutcome
from planner.solver.search import Search, search_cold, search_warm

WARM_PENALTY = 30.0  # μ a warm start begins with: stiff enough to keep what the given plan has settled


def solve(
    problem: Problem,
    settings: SolverSettings,
    *,
    progress: Callable[[Progress], None] | None = None,
    initial: Plan | None = None,
    should_stop: Callable[[], bool] | None = None,
    schedule: al.Schedule | None = None,
) -> SolveOutcome:
    """Search for the plan of lowest ergodicity that meets every limit.

    Deterministic for a seed, except that ``settings.time_limit`` and ``should_stop`` end it when they do.

    Args:
        problem: what to solve.
        settings: seed, time limit, starts, processes.
        progress: called after every round.
        initial: plan of the same robots to start from, with steps as long or longer.
        should_stop: asked before every iteration; True ends the search with the best plan so far. If no motion meets
            every limit yet, the most promising one gets two more seconds to do so; likewise at the time limit.
        schedule: the augmented Lagrangian's pace; for studies of the solver.

    Returns:
        The outcome; its plan is None unless every limit of the problem is met.
    """
    schedule = schedule or al.Schedule()
    if initial is not None:
        search = Search(problem, settings, replace(schedule, penalty=WARM_PENALTY), progress, should_stop)
        return search_warm(search, initial)
    if settings.processes > 1:
        return solve_parallel(problem, settings, schedule, progress, should_stop)
    return search_cold(Search(problem, settings, schedule, progress, should_stop))
