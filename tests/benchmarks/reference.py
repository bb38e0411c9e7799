"""``python -m tests.benchmarks.reference``: the paper's Algorithm 1 on the notebook case, as the authors ran it.

No margins, no speed limit, the authors' start in motion, 923 iterations as their code made, then on to 1000.
"""

from __future__ import annotations

import time

import numpy as np

from planner.solver.imec import algorithm
from planner.solver.imec.cost import Cost
from planner.solver.imec.parameters import Parameters
from tests.planner.test_planner_imec import as_published

AUTHORS = "authors    923  1.987e-03     0.0023     0.0037    506.0"
STOPS = (100, 923, 1000)


def run(stops: tuple[int, ...] = STOPS) -> None:
    """Print E and the worst violations at the given iterations."""
    print("Algorithm 1 on the notebook case")
    print("run      iter.          E  sep. [m]   obst. [m]    CPU s")
    print(AUTHORS)
    problem = as_published()
    cost = Cost.of(problem, Parameters())
    began = time.process_time()
    state = algorithm.init(cost, np.zeros(problem.dynamics.controls_shape))
    for stop in stops:
        while state.iteration < stop:
            state = algorithm.step(cost, state)
        missed = {c.name: max(float(c.violation(state.motion).max()), 0.0) for c in problem.constraints}
        E = problem.metric.value(state.motion.q[:-1])
        spent = time.process_time() - began
        clearance = missed.get("obstacle clearance", missed.get("obstacles", 0.0))
        print(f"ours     {state.iteration:5d}  {E:.3e}  {missed['separation']:9.4f}  {clearance:9.4f}  {spent:7.1f}")


if __name__ == "__main__":
    run()
