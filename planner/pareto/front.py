"""A front: plans for many weightings of a mission's maps, and what each is worth on each map."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from missions.arrays import Array, frozen
from missions.information import SeveralMaps, single_maps
from missions.schema import Mission
from missions.weights import reweighted
from planner.ergodic.metric import ErgodicMetric
from planner.ergodic.target import information_coefficients
from planner.errors import PlannerError
from planner.footprint.metric import FootprintMetric
from planner.indicators import ergodic_metric
from planner.pareto.dominance import non_dominated
from planner.pareto.hypervolume import hypervolume
from planner.pareto.ideal import ideal_vectors
from planner.plan import Plan
from planner.surface.metric import SurfaceMetric

Method = Literal["thin", "a-sles", "sles", "scalar", "nsga2"]
METHODS: tuple[Method, ...] = ("thin", "a-sles", "sles", "scalar", "nsga2")
COMPROMISE = "compromise"
REFINE = 9  # plans more that thin adds by default


class FrontError(PlannerError):
    """A front cannot be made, read, or has no such point."""


@dataclass(frozen=True)
class FrontSettings:
    """How the weight space is covered.

    Attributes:
        method: ``thin``: the ends and the preference, then wherever most is to be gained; ``a-sles`` and ``sles``: the
            paper's lattices, breadth first, each plan from its neighbour's; ``scalar``: sles' grid, every plan from
            scratch; ``nsga2``: the baseline of :mod:`planner.pareto.genetic`, which has a call of its own.
        step: of the lattice; a-sles: in units of the maps' distances.
        refine: plans more, after the lattice, where the front is thin; None becomes 9 with thin, else 0.
        radius: how far any weight may be from the mission's, which are where the search begins; None: everywhere.
    """

    method: Method = "thin"
    step: float = 0.1
    refine: int | None = None
    radius: float | None = None

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise FrontError(f"method: got {self.method!r}; allowed: {', '.join(METHODS)}")
        if not 0.0 < self.step <= 1.0:
            raise FrontError(f"step: got {self.step:g}; allowed: above 0, at most 1")
        if self.refine is None:
            object.__setattr__(self, "refine", REFINE if self.method == "thin" else 0)
        if self.extra < 0:
            raise FrontError(f"refine: got {self.refine}; allowed: at least 0")
        if self.radius is not None and not 0.0 < self.radius <= 1.0:
            raise FrontError(f"radius: got {self.radius:g}; allowed: above 0, at most 1")

    @property
    def extra(self) -> int:
        """Plans more, after the lattice."""
        return self.refine or 0


@dataclass(frozen=True)
class Maps:
    """A mission's maps as the front sees them; one map is a front of one point.

    Attributes:
        names: of the maps. metrics: E with respect to each. prefer: (m,) the mission's weights.
    """

    names: tuple[str, ...]
    metrics: tuple[ErgodicMetric | FootprintMetric, ...]
    prefer: Array

    @staticmethod
    def of(mission: Mission) -> Maps:
        """Of a mission.

        Raises:
            PlannerError: it looks at an object, whose surface has one information.
        """
        information, metric = mission.information, ergodic_metric(mission)
        if isinstance(metric, SurfaceMetric):
            raise PlannerError("a front of plans that look at an object; allowed: without one")
        several = information if isinstance(information, SeveralMaps) else None
        names = several.names if several is not None else ("information",)
        prefer = several.shares if several is not None else (1.0,)
        singles = [information_coefficients(single, metric.basis) for _, single in single_maps(information)]
        return Maps(names, tuple(replace(metric, phi_k=phi_k) for phi_k in singles), frozen(np.array(prefer)))

    @cached_property
    def distances(self) -> Array:
        """(m, m) √E(i, j) between maps."""
        phi = np.stack([metric.phi_k.ravel() for metric in self.metrics])
        apart = phi[:, None] - phi[None]
        return frozen(np.sqrt((self.metrics[0].basis.Lambda_k.ravel() * apart**2).sum(axis=2)))

    def vector(self, q: Array) -> Array:
        """(m,) ergodic vector of positions q (T, N, ν) [m]."""
        basis = self.metrics[0].basis
        c_k = self.metrics[0].statistics(q)
        return frozen(np.array([(basis.Lambda_k * (c_k - metric.phi_k) ** 2).sum() for metric in self.metrics]))


@dataclass(frozen=True)
class FrontPoint:
    """One plan of a front.

    Attributes:
        weights: (m,) it was made for. vector: (m,) its ergodicity on each map. plan: the samples.
        parent: index of the point whose plan it began with; None: from scratch. status: how its search ended.
    """

    weights: Array
    vector: Array
    plan: Plan
    parent: int | None
    status: str


@dataclass(frozen=True)
class Front:
    """Plans that trade one map for another.

    Attributes:
        mission: what was asked for. settings: how the weights were covered. names, distances: of the maps.
        points: the plans, in the order they were made.
        notes: what a reader has to know: a fall-back, searches that found nothing.
    """

    mission: Mission
    settings: FrontSettings
    names: tuple[str, ...]
    distances: Array
    points: tuple[FrontPoint, ...]
    notes: tuple[str, ...] = ()

    @cached_property
    def vectors(self) -> Array:
        """(n, m) ergodic vectors."""
        return frozen(np.array([point.vector for point in self.points]).reshape(len(self.points), len(self.names)))

    @cached_property
    def weights(self) -> Array:
        """(n, m)."""
        return frozen(np.array([point.weights for point in self.points]).reshape(len(self.points), len(self.names)))

    @cached_property
    def best(self) -> tuple[int, ...]:
        """Indices of the points that no other dominates."""
        return tuple(int(index) for index in np.flatnonzero(non_dominated(self.vectors)))

    @cached_property
    def hypervolume(self) -> float:
        """With respect to (1, …, 1)."""
        return hypervolume(self.vectors)

    @cached_property
    def ideal(self) -> float:
        """Hyper-volume of the ideal vectors for the same weights: about what there is to be had with as many plans."""
        return hypervolume(ideal_vectors(self.weights, self.distances))

    @cached_property
    def named(self) -> dict[str, int]:
        """Points people ask for: the best on each map, and the compromise that is nowhere far from the best."""
        if not self.points:
            return {}
        found = {name: int(self.vectors[:, column].argmin()) for column, name in enumerate(self.names)}
        low = self.vectors.min(axis=0)
        span = np.maximum(self.vectors[list(self.best)].max(axis=0) - low, 1e-300)
        found.setdefault(COMPROMISE, int(((self.vectors - low) / span).max(axis=1).argmin()))
        return found

    def find(self, pick: str) -> FrontPoint:
        """A point by its index or its name.

        Raises:
            FrontError: there is none.
        """
        if pick in self.named:
            return self.points[self.named[pick]]
        if pick.isdecimal() and int(pick) < len(self.points):
            return self.points[int(pick)]
        indices = f"0 to {len(self.points) - 1}" if self.points else "none"
        raise FrontError(f"no point {pick[:60]!r} on this front; allowed: {', '.join(self.named)}, {indices}")


def weighed(mission: Mission, weights: Array) -> Mission:
    """The mission with other weights; the mission itself where there is one map only."""
    if not isinstance(mission.information, SeveralMaps):
        return mission
    return reweighted(mission, [float(weight) for weight in weights])
