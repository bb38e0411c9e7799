"""The pipeline closes the loop on the certificate, and says what all of it cost."""

import dataclasses

import pytest

from planner import pipeline
from planner.certificate.certify import certify
from planner.errors import CertificateFailed
from planner.problem import build_problem
from planner.solver.methods import solve
from tests.planner.problems import small


@pytest.fixture
def seen(monkeypatch):
    """What the pipeline asked for: margins and outcomes by round. The first certificate misses obstacles by 3 mm."""
    margins, outcomes = [], []

    def built(mission, given, **more):
        margins.append(given)
        return build_problem(mission, given, **more)

    def solved(*args, **kwargs):
        outcomes.append(solve(*args, **kwargs))
        return outcomes[-1]

    def certified(mission, trajectories, transfers):
        found = certify(mission, trajectories, transfers)
        if len(outcomes) > 1:
            return found
        checks = [
            dataclasses.replace(check, value=check.limit - 0.003, passed=False) if check.name == "obstacles" else check
            for check in found.checks
        ]
        return dataclasses.replace(found, checks=tuple(checks))

    for name, double in (("build_problem", built), ("solve", solved), ("certify", certified)):
        monkeypatch.setattr(pipeline, name, double)
    return margins, outcomes


def test_the_margin_that_was_missed_grows_and_costs_add_up(seen):
    done = pipeline.make_flight_plan(small())
    (first, second), outcomes = seen
    assert done.certificate.passed
    assert second.obstacle == pytest.approx(first.obstacle + 0.004)
    assert second == dataclasses.replace(first, obstacle=second.obstacle)
    assert done.plan.evaluations == sum(outcome.plan.evaluations for outcome in outcomes)
    assert done.plan.seconds == pytest.approx(sum(outcome.plan.seconds for outcome in outcomes))


def test_margins_that_never_suffice_are_a_failure_with_the_certificate(seen, monkeypatch):
    monkeypatch.setattr(pipeline, "ROUNDS", 1)
    with pytest.raises(CertificateFailed) as failure:
        pipeline.make_flight_plan(small())
    assert not failure.value.certificate.passed
