"""Maps that change in flight: three re-plans in one flight of four drones, over a radio that loses packets."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from deploy.analysis.analyse import analyse
from deploy.flight.replanning import Replanning, _check, _Work
from deploy.flightlog.reader import read_log
from deploy.phases import Phase
from deploy.rehearsal import rehearse
from deploy.report.replans import replans_table
from deploy.scenario.load import parse_scenario
from missions.replanning import with_information
from planner.certificate.certify import certify
from planner.certificate.errors import CertificateError
from planner.errors import PlannerError
from planner.pipeline import make_flight_plan
from planner.replan import replan
from planner.trajectory.encode import decode
from planner.trajectory.legs import HALF
from tests.deploy import replan_bench as bench
from tests.deploy.flight_bench import certified

LOSS = """
name: lossy
seed: 3
events:
  - {fault: loss, when: mission_start, after: 0.5, rate: 0.15, duration: 30.0}
"""
JUMPS = (1e-3, 0.01, 0.1)  # [m], [m/s], [m/s²], as the certificate allows at joints


@pytest.fixture(scope="module")
def plan():
    return make_flight_plan(bench.mission())


@pytest.fixture(scope="module")
def flown(plan, tmp_path_factory):
    path = tmp_path_factory.mktemp("anew") / "flight.mcap"
    outcome, log = rehearse(
        plan, log_path=path, scenario=parse_scenario(LOSS, path="lossy.yaml", mission=plan.mission), replanner=replan
    )
    return outcome, read_log(log)


def named(record, name):
    return [event for event in record.events if event.name == name]


def test_three_new_plans_are_taken_over_by_all_while_packets_are_lost(flown):
    outcome, record = flown
    assert outcome.phase is Phase.LANDED
    assert not outcome.reason
    assert not outcome.faults
    start = named(record, "mission_start")[0].t
    for name, times in {
        "map_change": (2.0, 10.0, 18.0),
        "replanned": (5.0, 13.0, 21.0),
        "take_over": tuple(joint - 0.5 for joint in bench.JOINTS),
    }.items():
        assert [event.t - start for event in named(record, name)] == pytest.approx(times, abs=0.03), name
    assert not named(record, "old_plan")
    assert max(outcome.largest_error.values()) < 0.08
    assert len(named(record, "leg_start")) == 4 * 4


def test_what_was_flown_is_the_plan_that_the_log_holds(flown):
    """Its beginning is the first plan's, its map the last one's, and its certificate passes when it is made again."""
    _, record = flown
    final = record.flight_plan
    assert final.mission.information.type == "uniform"
    assert final.certificate.passed
    assert certify(final.mission, final.trajectories, final.transfers).checks == final.certificate.checks
    start = named(record, "mission_start")[0].t
    for name, encoded in final.trajectories.items():
        series = record.of(name, "reference")
        inside = (series.t > start + 0.1) & (series.t < start + 31.5)
        certified = decode(encoded).evaluate(series.t[inside] - start)[:, :3]
        assert np.abs(series["position"][inside] - certified).max() < 0.02, name  # a leg may begin a little late


def test_ergodicity_falls_with_every_new_plan(flown):
    _, record = flown
    for before, after in zip(named(record, "map_change"), named(record, "take_over"), strict=True):
        assert after.value < 0.7 * before.value


def test_nobody_comes_too_close_in_truth(flown, plan):
    """Of the poses that were measured, at all times of the search."""
    _, record = flown
    start = named(record, "mission_start")[0].t
    t = np.arange(start, start + 32.0, 0.05)
    q = []
    for robot in plan.mission.robots:
        series = record.of(robot.name, "pose")
        q.append(np.stack([np.interp(t, series.t, series["position"][:, axis]) for axis in range(3)], axis=1))
    apart = [np.linalg.norm(a - b, axis=1).min() for i, a in enumerate(q) for b in q[:i]]
    assert min(apart) > plan.mission.limits.separation - 0.05


def test_without_a_new_plan_the_old_one_goes_on_and_a_map_told_is_flown(plan, tmp_path):
    """Nonsense is told; then there is no plan, then one that may not be flown; then somebody tells a map."""
    waiting = [lambda current: _refuses(), lambda current: current]

    def replanner(current, mission, joint):
        return waiting.pop(0)(current) if waiting else replan(current, mission, joint)

    def new_map():
        return words.pop(0) if words and (len(words) > 1 or not waiting) else None

    words = ["[not, a, map]", "{type: gaussians, components: [{mean: [0.7, 0.6], covariance: 1e-1}]}"]
    text = bench.TEXT.partition("    - {time: 18.0")[0]
    first_two = bench.mission(text.replace("settle_time: 0.5", "settle_time: 0.5, return_to: none"))
    fewer = certified(first_two, plan.trajectories)
    outcome, log = rehearse(fewer, log_path=tmp_path / "flight.mcap", replanner=replanner, new_map=new_map)
    record = read_log(log)
    assert outcome.phase is Phase.LANDED
    assert not outcome.faults
    kept = [event.text for event in named(record, "old_plan")]
    assert len(kept) == 2
    assert "there is none" in kept[0]
    assert "where there is a leg of the old one" in kept[1]
    changes = [event.value for event in named(record, "map_change")]
    assert changes[0] is None  # nonsense
    assert len(changes) == 4
    assert len(named(record, "take_over")) == 1
    assert record.flight_plan.mission.information.components[0].mean == (0.7, 0.6)


def _refuses():
    raise PlannerError("there is none")


# ------------------------------------------------------------------------------------------- what is refused


@pytest.fixture(scope="module")
def anew(plan):
    mission = with_information(plan.mission, plan.mission.replanning.changes[0].information)
    return replan(plan, mission, 0)


def test_a_new_plan_goes_on_from_the_old_one(plan, anew):
    """Its first legs are those that are flown; position, velocity and acceleration are continuous where it begins."""
    for name, new in anew.trajectories.items():
        old = plan.trajectories[name]
        assert new.legs[:1] == old.legs[:1]
        assert new.legs[1].data != old.legs[1].data
        assert new.legs[1].offset == old.legs[1].offset + HALF // 2 >= old.legs[1].end
        whole = decode(new)
        for order, limit in enumerate(JUMPS):
            before, after = whole.evaluate(np.array([8.0 - 1e-9, 8.0 + 1e-9]), order)[:, :3]
            assert np.linalg.norm(after - before) <= limit, (name, order)
    assert anew.certificate.passed
    _check(plan, anew, 0)


def test_what_may_not_be_flown_is_refused(plan, anew):
    failed = dataclasses.replace(anew.certificate.checks[0], passed=False, severity="failure")
    bad = dataclasses.replace(anew.certificate, checks=(failed, *anew.certificate.checks[1:]))
    with pytest.raises(CertificateError, match="certificate fails"):
        _check(plan, dataclasses.replace(anew, certificate=bad), 0)
    with pytest.raises(CertificateError, match="not those that were certified"):
        _check(plan, dataclasses.replace(anew, trajectories=plan.trajectories), 0)
    with pytest.raises(CertificateError, match="beginning is not what is flown"):
        _check(plan, anew, 1)
    certificate = dataclasses.replace(anew.certificate, transfers_sha256="")
    with pytest.raises(CertificateError, match="way back"):
        _check(plan, dataclasses.replace(anew, certificate=certificate, transfers=None), 0)


def test_the_report_shows_what_became_of_each_change(flown):
    _, record = flown
    text = replans_table(analyse(record))
    assert text.count("flown by all") == 3
    assert "Maps that changed in flight" in text


def test_what_is_late_or_has_not_arrived_everywhere_is_dropped(plan, anew):
    """The deadline of the plan is its budget, that of the upload half a second before the joint."""
    said, now = [], [5.0]
    chains = SimpleNamespace(
        due=lambda number: bench.JOINTS[number - 1],
        unready=lambda: {"cf2": "not uploaded yet"},
        offer=lambda trajectories, number: said.append(("offered", str(number))),
        withdraw=lambda: said.append(("withdrawn", "")),
    )
    flight = SimpleNamespace(
        plan=plan,
        clock=SimpleNamespace(now=lambda: now[0]),
        event=lambda name, text, **_: said.append((name, text)),
    )
    replanning, aside = Replanning(flight, chains), SimpleNamespace(done=False, outcome=lambda: (anew, {}))
    replanning._work = _Work(0, anew.mission, 5.0, 0.3, aside)
    replanning.turn()
    assert said == [("old_plan", "the old plan goes on: no plan within 3 s")]
    aside.done = True
    replanning._work = _Work(0, anew.mission, 5.0, 0.3, aside)
    replanning.turn()
    now[0] = 7.4
    replanning.turn()
    assert [name for name, _ in said[1:]] == ["replanned", "offered"]
    now[0] = 7.5
    replanning.turn()
    assert said[3:] == [("withdrawn", ""), ("old_plan", "the old plan goes on: cf2: not uploaded yet")]
    assert flight.plan is plan
