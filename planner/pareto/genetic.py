"""The baseline: NSGA-II (Deb et al. 2002) from pymoo, which knows nothing of gradients.

pymoo is an optional package: ``pip install ergoflie[pymoo]``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from missions.arrays import Array, frozen
from missions.schema import Mission
from planner.feasibility import check_feasible
from planner.pareto.episodes import CANDIDATES
from planner.pareto.front import Front, FrontError, FrontPoint, FrontSettings, Maps
from planner.pareto.ideal import ideal_vectors
from planner.pareto.simplex import breadth_first, grid
from planner.plan import Plan
from planner.problem import Problem, build_problem
from planner.solver.misses import METRE_TOLERANCE, worst_miss
from planner.solver.modes import ControlModes
from planner.solver.scaling import scaled_modes

POPULATION, GENERATIONS = 100, 150
WIDEST = 0.2  # of the solver's scaled variables; more is beyond what drones can do
FIRST = 0.01  # standard deviation of the first generation: slow plans, which miss no limit

Objectives = Callable[[Array], tuple[Array, Array]]


class Population(NamedTuple):
    """What NSGA-II ends with: variables (n, k) and objectives (n, m) of plans that meet all constraints."""

    z: Array
    vectors: Array


def nsga2(
    objectives: Objectives,
    widest: Array,
    *,
    maps: int,
    population: int,
    generations: int,
    seed: int = 0,
    begin: Array | None = None,
    progress: Callable[[int], None] | None = None,
) -> Population:
    """Non-dominated plans.

    Args:
        objectives: vectors (B, m) and constraint violations (B,), met where ≤ 0, of variables (B, k).
        widest: (k,) variables are within ± this.
        maps: m.
        population: size of a generation.
        generations: how many.
        seed: of everything random.
        begin: (population, k) the first generation; None: anywhere.
        progress: called with the number of generations so far.

    Raises:
        FrontError: pymoo is not installed.
    """
    try:
        from pymoo.algorithms.moo.nsga2 import NSGA2
        from pymoo.core.callback import Callback
        from pymoo.core.problem import Problem
        from pymoo.optimize import minimize
    except ImportError:
        raise FrontError("method nsga2 needs pymoo: pip install 'ergoflie[pymoo]'") from None

    class Search(Problem):  # type: ignore[misc]
        """The problem as pymoo wants it."""

        def _evaluate(self, z: Array, out: dict[str, Array], *_: Any, **__: Any) -> None:  # noqa: ANN401 - pymoo's
            out["F"], violations = objectives(z)
            out["G"] = violations[:, None]

    class Told(Callback):  # type: ignore[misc]
        """Passes the generation on."""

        def notify(self, algorithm: Any) -> None:  # noqa: ANN401 - pymoo's
            if progress is not None:
                progress(algorithm.n_gen)

    problem = Search(n_var=len(widest), n_obj=maps, n_ieq_constr=1, xl=-widest, xu=widest)
    algorithm = NSGA2(pop_size=population) if begin is None else NSGA2(pop_size=population, sampling=begin)
    found = minimize(problem, algorithm, ("n_gen", generations), seed=seed, callback=Told())
    if found.X is None:
        return Population(np.empty((0, len(widest))), np.empty((0, maps)))
    return Population(np.atleast_2d(found.X), np.atleast_2d(found.F))


def genetic_front(
    mission: Mission,
    *,
    population: int = POPULATION,
    generations: int = GENERATIONS,
    progress: Callable[[int], None] | None = None,
) -> Front:
    """A front of a mission by NSGA-II over the solver's own variables, with its limits as constraints.

    Args:
        mission: any that can be planned.
        population: plans of a generation.
        generations: how many.
        progress: called with the number of generations so far.

    Raises:
        FrontError: pymoo is not installed, or no plan met every limit.
        UnreachableError: the mission is provably impossible.
    """
    check_feasible(mission)
    maps, flights = Maps.of(mission), _Flights.of(mission)

    def objectives(z: Array) -> tuple[Array, Array]:
        plans = [flights.plan(row) for row in z]
        missed = [plan.violation - METRE_TOLERANCE for plan in plans]
        return np.array([maps.vector(plan.q[:-1]) for plan in plans]), np.array(missed)

    found = nsga2(
        objectives,
        np.full(flights.variables, WIDEST),
        maps=len(maps.names),
        population=population,
        generations=generations,
        seed=mission.solver.seed,
        begin=FIRST * np.random.default_rng(mission.solver.seed).standard_normal((population, flights.variables)),
        progress=progress,
    )
    if len(found.z) == 0:
        raise FrontError(f"NSGA-II found no plan that meets every limit in {generations} generations of {population}")
    status = f"NSGA-II, {population} × {generations} evaluations"
    points = []
    for z, vector in zip(found.z, found.vectors, strict=True):
        weights = _weights(vector, maps)
        E = float(weights @ (vector - ideal_vectors(weights[None], maps.distances)[0]))
        plan = replace(flights.plan(z), ergodicity=E, seed=mission.solver.seed)
        points.append(FrontPoint(weights, frozen(vector), plan, None, status))
    return Front(mission, FrontSettings("nsga2"), maps.names, maps.distances, tuple(points))


@dataclass(frozen=True)
class _Flights:
    """Plans of a mission by the solver's variables."""

    problem: Problem
    modes: ControlModes

    @staticmethod
    def of(mission: Mission) -> _Flights:
        problem = build_problem(mission, coarse=False)
        return _Flights(problem, scaled_modes(problem))

    @property
    def variables(self) -> int:
        """How many variables there are."""
        return self.modes.count * math.prod(self.problem.dynamics.controls_shape[1:])

    def plan(self, z: Array) -> Plan:
        """The plan of variables (k,), with the worst it misses a limit by, without its ergodicity."""
        dynamics = self.problem.dynamics
        motion = dynamics.rollout(self.modes.controls(z.reshape(-1, *dynamics.controls_shape[1:])))
        v = motion.v.copy()
        if dynamics.rests:
            v[-1] = 0.0  # by construction, up to rounding
        t = np.arange(len(motion.q), dtype=np.float64) * self.problem.dt
        violation = max(worst_miss(self.problem.constraints, motion), 0.0)
        return Plan(t, motion.q, v, motion.u, math.nan, violation)


def _weights(vector: Array, maps: Maps) -> Array:
    """The weights for which a plan is nearest to the ideal: it was made for none."""
    count = len(maps.names)
    if count == 1:
        return frozen(np.ones(1))
    everywhere = np.array([e.weights for e in breadth_first(grid(count, 1.0 / CANDIDATES[count]), maps.prefer)])
    missed = everywhere @ vector - (everywhere * ideal_vectors(everywhere, maps.distances)).sum(axis=1)
    return frozen(everywhere[int(missed.argmin())])
