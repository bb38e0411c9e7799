"""What the mission counts on is what a flight takes of the modelled radio."""

import dataclasses
from collections import Counter

import pytest

from deploy.phases import Phase
from deploy.radio.simulated.air.line import Line
from deploy.radio.simulated.air.model import AirModel
from missions.radio import background_rate
from missions.schema import Radio
from tests.deploy.flight_bench import fly_on, small_mission, small_plan, stage

HIGH = 0.4  # [m]


@pytest.mark.parametrize("rates", [{}, {"log_rate": 50.0}, {"pose_rate": 100.0}], ids=str)
def test_exchanges_in_the_air_are_what_the_budget_says(tmp_path, monkeypatch, rates):
    mission = small_mission(**rates)
    airborne, useful = [], Counter()
    exchange = Line.exchange

    def counted(line, now, slot):
        before = (len(line._waiting), len(line._answers))
        end = exchange(line, now, slot)
        if airborne and airborne[-1] >= now - 0.01 and (len(line._waiting), len(line._answers)) < before:
            useful[line] += 1
        return end

    monkeypatch.setattr(Line, "exchange", counted)
    with stage(tmp_path, small_plan(mission), air=AirModel.of(mission)) as ready:

        def look(t):
            if ready.world.positions[:, 2].min() > HIGH:
                airborne.append(t)

        ready.world.every(0.01, look)
        assert fly_on(ready, small_plan(mission), mocap=ready.capture).phase is Phase.LANDED
    measured = max(useful.values()) / (len(airborne) * 0.01)
    assert 0.85 * background_rate(mission) < measured < background_rate(mission)


def test_a_dongle_that_carries_no_more_than_the_budget_carries_the_flight(tmp_path):
    """Two drones on a dongle of just so many exchanges a second: nobody is late, lost or poorly heard."""
    mission = small_mission()
    tight = dataclasses.replace(mission, radio=Radio(packet_rate=2.0 * background_rate(mission)))
    plan = small_plan(tight)
    assert next(check for check in plan.certificate.checks if check.name == "radio load").passed
    with stage(tmp_path, plan, air=AirModel.of(tight)) as ready:
        outcome = fly_on(ready, plan, mocap=ready.capture)
        assert outcome.phase is Phase.LANDED
        assert all(line.dropped == 0 for line in ready.air.lines.values())
    assert max(outcome.largest_error.values()) < 0.1  # [m]
