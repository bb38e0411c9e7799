"""The pipeline closes the loop on the certificate, and says what all of it cost."""

import pytest

from planner import pipeline
from planner.errors import CertificateFailed
from planner.margins import Margins
from planner.solver.methods import solve
from tests.planner.problems import small

TOO_WIDE = Margins(separation=-0.03, obstacle=-0.03, workspace=-0.03, probability=-0.2)


@pytest.fixture
def outcomes(monkeypatch):
    """Outcomes of every round, the first of which plans beyond the limits."""
    found = []

    def recorded(*args, **kwargs):
        found.append(solve(*args, **kwargs))
        return found[-1]

    monkeypatch.setattr(pipeline, "solve", recorded)
    monkeypatch.setattr(pipeline, "Margins", lambda: TOO_WIDE)
    return found


def test_margins_grow_until_the_certificate_passes_and_costs_add_up(outcomes):
    done = pipeline.make_flight_plan(small())
    assert done.certificate.passed
    assert len(outcomes) > 1
    assert done.plan.evaluations == sum(outcome.plan.evaluations for outcome in outcomes)
    assert done.plan.seconds == pytest.approx(sum(outcome.plan.seconds for outcome in outcomes))


def test_margins_that_never_suffice_are_a_failure_with_the_certificate(outcomes, monkeypatch):
    monkeypatch.setattr(pipeline, "ROUNDS", 1)
    with pytest.raises(CertificateFailed) as failure:
        pipeline.make_flight_plan(small())
    assert not failure.value.certificate.passed
