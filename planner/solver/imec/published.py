"""Algorithm 1 as the authors run it: until its own criterion holds, and the last motion counts, limits met or not.

:func:`planner.solver.imec.solve.solve` gives no plan that misses a limit, as every solver here. The paper reports such
motions too (Table II: "infeasible local minima where some constraints are unsatisfied"), so comparisons need them.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from missions.arrays import Array
from missions.schema import Mission
from planner.dynamics import Motion
from planner.problem import Margins, build_problem
from planner.solver.imec import algorithm
from planner.solver.imec.cost import Cost
from planner.solver.imec.parameters import Parameters
from planner.solver.misses import violations
from planner.solver.result import Violation

NO_MARGINS = Margins(
    separation=0.0, obstacle=0.0, workspace=0.0, acceleration=0.0, speed=0.0, probability=0.0, range=0.0, contact=0.0
)
STUCK = 100  # iterations without any step that descends; only the penalty grows then, and nothing comes of it
DISTURBANCE = 1e-3  # standard deviation of a first guess that is not zero, in the controls' units


class Ending(NamedTuple):
    """The last motion of a run.

    Attributes:
        motion: steps, and what lies between them. E: its ergodicity.
        violation: sum of the scaled violations. settled: whether the paper's criterion ended the run.
        missed: limits it misses. iterations: done. seconds: CPU time.
    """

    motion: Motion
    E: float
    violation: float
    settled: bool
    missed: tuple[Violation, ...]
    iterations: int
    seconds: float


def run_published(
    mission: Mission,
    *,
    parameters: Parameters | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> Ending:
    """Run Algorithm 1 on a mission without margins.

    Args:
        mission: what is asked for; of its solver settings only the seed and the weight of controls count.
        parameters: Table I.
        should_stop: asked before every iteration.
    """
    parameters = parameters or Parameters()
    problem = build_problem(mission, NO_MARGINS, coarse=False)
    cost, began = Cost.of(problem, parameters), time.process_time()
    state = algorithm.init(cost, first_guess(problem.dynamics.controls_shape, mission.solver.seed))
    settled, stuck = False, 0
    while not settled and stuck < STUCK and state.iteration < parameters.iterations:
        if should_stop is not None and should_stop():
            break
        before, state = state, algorithm.step(cost, state)
        settled = algorithm.terminate(cost, state)
        stuck = stuck + 1 if state.motion is before.motion else 0
    motion = problem.dynamics.rollout(state.u)
    return Ending(
        motion=motion,
        E=problem.metric.value(motion.q[:-1]),
        violation=state.violation,
        settled=settled,
        missed=violations(problem.constraints, motion),
        iterations=state.iteration,
        seconds=time.process_time() - began,
    )


def first_guess(shape: tuple[int, ...], seed: int) -> Array:
    """Zero controls as in the paper for seed 0; for others a slight disturbance, which shows how much is chance."""
    if not seed:
        return np.zeros(shape)
    return DISTURBANCE * np.random.default_rng(seed).standard_normal(shape)
