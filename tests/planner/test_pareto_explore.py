"""Fronts of missions: covered, resumed, read again, picked and certified."""

import dataclasses
import json

import numpy as np
import pytest

from missions.information import Gaussian, GaussianMixtureMap, NamedMap, SeveralMaps, UniformMap
from missions.loader import parse_mission
from missions.schema import Horizon, ProbabilisticConnectivity, SolverSettings
from planner.errors import UnreachableError
from planner.pareto.episodes import beaten_episodes, first_episodes, widest_gap
from planner.pareto.explore import explore
from planner.pareto.file import front_text, parse_front, read_front
from planner.pareto.front import FrontError, FrontSettings, Maps
from planner.pareto.ideal import ideal_vectors
from planner.pareto.pick import flight_plan_of
from planner.problem import build_problem
from planner.solver.solve import solve
from tests.planner.problems import robots, small

TEXT = """\
schema_version: 1
name: pair
workspace: {lower: [0.0, 0.0], upper: [2.0, 2.0]}
horizon: {duration: 8.0, dt: 0.2}
information:
  type: several
  maps:
    - {name: people, map: {type: gaussians, components: [{mean: [0.6, 0.6], covariance: 0.08}]}}
    - {name: gas, map: {type: gaussians, components: [{mean: [1.4, 1.4], covariance: 0.08}]}}
robots: [{name: a, start: [1.0, 0.5]}, {name: b, start: [1.0, 1.5]}]
obstacles: [{type: circle, center: [1.0, 1.0], radius: 0.2}]
connectivity: {policy: probabilistic, range: 0.7, sub_periods: 1, threshold: 0.1}
limits: {acceleration: 0.6, speed: 1.0, separation: 0.3}
solver: {starts: 1}
"""


def maps(*components):
    named = (NamedMap(f"map{i}", GaussianMixtureMap((gaussian,))) for i, gaussian in enumerate(components))
    return SeveralMaps(tuple(named))


@pytest.fixture(scope="module")
def mission():
    return parse_mission(TEXT, path="pair.yaml", read_file={}.__getitem__)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("front") / "plans"


@pytest.fixture(scope="module")
def front(mission, folder):
    return explore(mission, FrontSettings("thin", refine=2), folder, processes=0)


def test_a_front_trades_one_map_for_the_other_within_every_limit(front, mission):
    assert front.names == ("people", "gas")
    assert front.weights[:3].tolist() == [[0.5, 0.5], [1.0, 0.0], [0.0, 1.0]]
    assert len(front.points) == 5
    assert len(front.best) >= 4
    order = np.argsort(front.weights[list(front.best), 0])
    assert (np.diff(front.vectors[list(front.best)][order], axis=0) * [-1.0, 1.0] > 0.0).all()
    assert 0.0 < front.hypervolume < 1.0
    for w in front.weights:  # no plan is below the ideal of any weighting
        assert (front.vectors @ w >= w @ ideal_vectors(w[None], front.distances)[0]).all()
    for point in front.points:
        assert point.plan.violation <= 1e-3
        weighted = point.weights @ point.vector - point.weights @ ideal_vectors(point.weights[None], front.distances)[0]
        assert point.plan.ergodicity == pytest.approx(weighted, rel=1e-6)
    assert front.points[0].parent is None
    assert all(0 <= point.parent < 5 for point in front.points[1:])
    assert front.named["people"] == int(front.vectors[:, 0].argmin())
    assert set(front.named) == {"people", "gas", "compromise"}


def test_the_widest_gap_is_named_and_closing_gaps_narrows_it(front):
    coarse = dataclasses.replace(front, points=front.points[:3])
    before, after = widest_gap(coarse), widest_gap(front)
    assert before.gain > after.gain > 0.0
    assert 0.02 < before.weights.min() < 0.48  # between the middle and an end
    assert before.weights == pytest.approx(front.weights[3])  # where the next plan was placed


def test_one_map_is_plain_planning():
    one = small(robots=robots((-0.6, -0.6)), solver=SolverSettings(starts=2), horizon=Horizon(8.0, 0.2))
    front = explore(one, FrontSettings("sles"), processes=0)
    plain = solve(build_problem(one), one.solver).plan
    assert len(front.points) == 1
    assert widest_gap(front) is None
    assert np.array_equal(front.points[0].plan.u, plain.u)
    assert front.vectors[0] == pytest.approx([plain.ergodicity])


def test_what_is_finished_is_not_searched_again_and_stays_the_same(front, mission, folder, monkeypatch):
    monkeypatch.setattr("planner.pareto.work.search", lambda *_: pytest.fail("searched again"))
    told = []
    again = explore(mission, FrontSettings("thin", refine=2), folder, processes=0, progress=told.append)
    assert np.array_equal(again.vectors, front.vectors)
    assert told[-1].done == told[-1].total == 5


def test_a_half_written_search_is_run_again(front, mission, folder, monkeypatch):
    path = max(folder.iterdir(), key=lambda file: file.stat().st_mtime)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    ran = []

    def note(*task):
        ran.append(task)
        return None, "no plan today"

    monkeypatch.setattr("planner.pareto.work.search", note)
    again = explore(mission, FrontSettings("thin", refine=2), folder, processes=0)
    assert len(ran) == 1
    assert len(again.points) == 4
    assert any("no plan today" in text for text in again.notes)
    path.write_bytes(whole)


def test_an_interruption_keeps_what_there_is(mission, folder, front, monkeypatch, tmp_path):
    asked = []

    def should_stop():
        asked.append(1)
        return len(asked) > 1

    plan = front.points[0].plan
    monkeypatch.setattr("planner.pareto.work.search", lambda *_: (plan, "fine"))
    cut = explore(mission, FrontSettings("thin", refine=2), tmp_path, processes=0, should_stop=should_stop)
    assert len(cut.points) == 1


def test_workers_make_no_difference(front, mission):
    """The first three plans of the same front, two of which run at the same time."""
    two = explore(mission, FrontSettings("thin", refine=0), processes=2)
    assert np.array_equal(two.vectors, front.vectors[:3])


def test_a_front_comes_back_from_its_text(front, tmp_path):
    path = tmp_path / "pair.front.json"
    path.write_text(front_text(front))
    again = read_front(path)
    assert np.array_equal(again.weights, front.weights)
    assert again.vectors == pytest.approx(front.vectors, rel=1e-9)
    assert [point.parent for point in again.points] == [point.parent for point in front.points]
    assert again.mission == front.mission
    assert again.named == front.named
    for mine, other in zip(again.points, front.points, strict=True):
        assert np.array_equal(mine.plan.u, other.plan.u)
        assert mine.plan.q == pytest.approx(other.plan.q, abs=1e-12)


def edited(front, **changes):
    value = json.loads(front_text(front))
    value["points"][1] |= changes
    return json.dumps(value)


def test_damaged_fronts_are_refused_in_one_line(front):
    text = front_text(front)
    whole = json.loads(text)
    for broken, message in (
        (text[: len(text) // 2], "f: not a front file: it is no JSON, or cut short"),
        ("[]", "f: not a front file; 'ergoflie pareto' makes them"),
        (json.dumps(whole | {"format": 9}), "f: format 9 of the front; this version reads 1"),
        (json.dumps({**whole, "points": None}), "f: the front cannot be understood"),
        (json.dumps({**whole, "mission": {**whole["mission"], "text": "name: x"}}), "f: the mission in it cannot be"),
        (edited(front, vector=[0.1, 0.1]), r"f: point 1: its plan is worth \[.*\], not \[0\.1, 0\.1\]: the file was"),
        (edited(front, weights=[0.9, 0.9]), r"f: point 1: got weights \[0\.9, 0\.9\]; allowed: one for each map"),
        (edited(front, shape=[1, 2]), r"f: point 1: got controls of shape \(1, 2\); allowed: \(40, 2, 2\)"),
        (edited(front, u="AAAA"), "f: the front cannot be understood"),
        (edited(front, parent=-4), "f: point 1: got parent -4"),
    ):
        with pytest.raises(FrontError, match=message) as caught:
            parse_front(broken, "f")
        assert "\n" not in str(caught.value)
    with pytest.raises(FrontError, match="cannot read the front: No such file"):
        read_front("nowhere.front.json")


def test_what_is_picked_is_certified_for_its_weights(front):
    flight = flight_plan_of(front, "people")
    point = front.find("people")
    assert flight.certificate.passed
    assert flight.mission.information.shares == tuple(point.weights)
    assert f"weights: {point.weights.tolist()}" in flight.mission.source.text
    assert flight.certificate.mission_sha256 == flight.mission.source.sha256
    assert np.array_equal(flight.plan.u, point.plan.u), "the plan that was picked is what flies"
    assert flight.certificate.indicators.ergodicity == pytest.approx(point.plan.ergodicity, abs=5e-3)


def test_a_point_that_is_not_there(front):
    with pytest.raises(FrontError, match=r"no point '5' on this front; allowed: people, gas, compromise, 0 to 4"):
        front.find("5")
    assert front.find("4") is front.points[4]


def test_maps_that_are_alike_fall_back_with_a_message():
    same = small(information=maps(Gaussian((0.4, 0.2), 0.08), Gaussian((0.4, 0.2), 0.08)))
    episodes, notes = first_episodes(Maps.of(same), FrontSettings("a-sles", step=0.5))
    assert [episode.weights.tolist() for episode in episodes] == [[0.5, 0.5], [0.0, 1.0], [1.0, 0.0]]
    assert notes[0].startswith("A-SLES needs maps that differ: map 2 adds nothing")


def test_methods_cover_as_they_say():
    three = Maps.of(small(information=maps(*(Gaussian(mean, 0.05) for mean in ((-0.5, 0.0), (0.5, 0.0), (0.0, 0.6))))))
    grid, _ = first_episodes(three, FrontSettings("sles", step=0.25))
    assert len(grid) == 15
    scratch, _ = first_episodes(three, FrontSettings("scalar", step=0.25))
    assert [e.weights.tolist() for e in scratch] == [e.weights.tolist() for e in grid]
    assert all(episode.parent is None for episode in scratch)
    adaptive, _ = first_episodes(three, FrontSettings("a-sles", step=0.3))
    assert {(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)} <= {tuple(e.weights) for e in adaptive}
    near, _ = first_episodes(three, FrontSettings("a-sles", step=0.1, radius=0.2))
    assert max(np.abs(e.weights - 1 / 3).max() for e in near) <= 0.2 + 1e-9
    ends, _ = first_episodes(three, FrontSettings("thin", radius=0.2))
    assert len(ends) == 1


def test_whoever_is_beaten_by_another_plan_searches_again_from_it():
    three = Maps.of(small(information=maps(Gaussian((-0.5, 0.0), 0.05), Gaussian((0.5, 0.0), 0.05))))
    weights = np.array([[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]])
    vectors = ideal_vectors(weights, three.distances) + 0.01
    assert beaten_episodes(three, weights, vectors) == {}
    vectors[0] += 0.5 * three.distances[0, 1] ** 2
    again = beaten_episodes(three, weights, vectors)
    assert list(again) == [0]
    assert again[0].parent == 1


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"method": "sle"}, "method: got 'sle'; allowed: thin, a-sles, sles, scalar, nsga2"),
        ({"step": 0.0}, "step: got 0; allowed: above 0, at most 1"),
        ({"refine": -1}, "refine: got -1; allowed: at least 0"),
        ({"radius": 2.0}, "radius: got 2; allowed: above 0, at most 1"),
    ],
)
def test_settings_are_checked(changes, message):
    with pytest.raises(FrontError, match=message):
        FrontSettings(**changes)


def test_plans_more_are_for_the_method_that_lives_by_them():
    assert FrontSettings().extra == FrontSettings("thin").refine == 9
    assert FrontSettings("sles").extra == 0
    assert FrontSettings("sles", refine=3).extra == 3


def test_what_cannot_be_planned_is_said_before_anything_runs():
    far = small(
        ProbabilisticConnectivity(range=0.1, sub_periods=4, threshold=0.5),
        robots=robots((-0.9, -0.9), (0.9, 0.9)),
        information=maps(Gaussian((0.4, 0.2), 0.08), Gaussian((-0.4, 0.2), 0.08)),
    )
    with pytest.raises(UnreachableError, match="connection"):
        explore(far, FrontSettings("thin", refine=0), processes=0)


def test_a_uniform_map_is_a_map_like_any_other():
    both = SeveralMaps((NamedMap("all", UniformMap()), NamedMap("one", GaussianMixtureMap((Gaussian((0, 0), 0.05),)))))
    found = Maps.of(small(information=both))
    assert found.distances[0, 1] > 0.1
    assert found.metrics[0].phi_k[0, 0] == 1.0
