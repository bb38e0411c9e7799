"""The NSGA-II baseline: runs where pymoo is installed, and says how to get it where it is not."""

import sys

import numpy as np
import pytest

from missions.information import Gaussian, GaussianMixtureMap, NamedMap, SeveralMaps
from missions.schema import Horizon
from planner.pareto.explore import explore
from planner.pareto.front import FrontError, FrontSettings
from planner.pareto.genetic import genetic_front, nsga2
from planner.pareto.ideal import ideal_vectors
from tests.planner.problems import robots, small


def mission():
    maps = (NamedMap(f"m{i}", GaussianMixtureMap((Gaussian((x, 0.3), 0.08),))) for i, x in enumerate((-0.5, 0.5)))
    return small(
        information=SeveralMaps(tuple(maps)), robots=robots((0.0, -0.6)), obstacles=(), horizon=Horizon(8.0, 0.2)
    )


def test_without_pymoo_the_remedy_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymoo.algorithms.moo.nsga2", None)
    with pytest.raises(FrontError, match=r"needs pymoo: pip install 'ergoflie\[pymoo\]'"):
        nsga2(lambda z: (z, z[:, 0]), np.ones(2), maps=2, population=4, generations=1)


def test_it_covers_no_weights():
    with pytest.raises(FrontError, match="genetic_front"):
        explore(mission(), FrontSettings("nsga2"), processes=0)


def test_a_front_of_a_mission():
    pytest.importorskip("pymoo")
    told = []
    front = genetic_front(mission(), population=20, generations=12, progress=told.append)
    assert told == list(range(1, 13))
    assert len(front.best) == len(front.points)
    for point in front.points:
        assert point.plan.violation <= 1e-3
        ideal = ideal_vectors(point.weights[None], front.distances)[0]
        assert point.weights @ (point.vector - ideal) == pytest.approx(point.plan.ergodicity)


def test_known_front():
    pytest.importorskip("pymoo")

    def schaffer(z):
        return np.stack((z[:, 0] ** 2, (z[:, 0] - 1.0) ** 2), axis=1), z[:, 0] - 0.5

    found = nsga2(schaffer, np.full(1, 4.0), maps=2, population=20, generations=30)
    assert found.z.max() <= 0.5
    assert np.sqrt(found.vectors).sum(axis=1) == pytest.approx(1.0, abs=0.02)
