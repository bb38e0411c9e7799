"""The judge of the fault matrix finds what it has to: flights made up to break one rule each."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from deploy.analysis.verdict import Level
from deploy.errors import PreflightError
from deploy.flight.records import FlightOutcome
from deploy.flightlog.reader import Event
from deploy.phases import Phase
from deploy.preflight import PreflightReport
from tests.chaos.arena import NAMES, arena
from tests.chaos.faults import FAULTS, cell, matrix, sequence
from tests.chaos.flown import Flown
from tests.chaos.judge import BLIND, FALLING, judge

T = np.arange(0.0, 12.0, 0.1)
UP = slice(10, 100)  # in the air
FAULT = 50  # rows, when something goes wrong


def made_up(fault="blink", phase=Phase.ABORTED, reason="cf2: link lost", level=Level.FAIL, finding="separation"):
    """Everybody rises, hovers over his pad and lands; the fault happens in between."""
    position = np.zeros((len(T), len(NAMES), 3))
    position[:, :, :2] = [robot.pad for robot in arena().robots]
    position[UP, :, 2] = 0.5
    event = FAULTS[fault].event
    whom = f" ({', '.join(FAULTS[fault].whom)})" if "to" in event or "link" in event["fault"] else ""
    events = (Event(T[FAULT], "scenario", f"scenario: {event['fault']}{whom}"), Event(9.0, "phase", phase.value))
    return Flown(
        cell(fault, "on mission"),
        FlightOutcome(phase, reason, PreflightReport(), landed=dict.fromkeys(NAMES, True)),
        SimpleNamespace(events=events, complete=True, problems=()),
        SimpleNamespace(verdict=SimpleNamespace(level=level, findings=[SimpleNamespace(level=level, name=finding)])),
        T,
        position,
        position[:, :, 2] > 0.0,
    )


def moved(flown, robot, rows, by):
    """The same with one drone elsewhere for a while."""
    position = flown.position.copy()
    position[rows, NAMES.index(robot)] += by
    return replace(flown, position=position)


def broken(flown):
    return "; ".join(judge(flown).problems)


def test_a_flight_that_keeps_the_rules():
    judged = judge(made_up())
    assert judged.problems == ()
    assert judged.outcome == "aborted"
    assert judged.separation == pytest.approx(0.6)
    assert judged.down == pytest.approx(T[99] - T[FAULT], abs=0.02)
    assert judged.excursion == pytest.approx(-0.3)


def test_drones_that_come_too_near():
    assert "0.10 m apart at 2.00 s" in broken(moved(made_up(), "cf1", [20], [0.5, 0.0, 0.0]))
    assert broken(moved(made_up(), "cf1", [2], [0.5, 0.0, 0.0])) == ""  # on the ground: somebody carries it


def test_who_is_struck_may_fall_onto_others_and_nobody_else_may():
    flown = made_up("dead motor", reason="cf2: tilts")
    assert broken(moved(flown, "cf2", [FAULT + 5], [0.5, 0.0, 0.0])) == ""
    assert "apart" in broken(moved(flown, "cf2", [FAULT - 5], [0.5, 0.0, 0.0]))
    assert "apart" in broken(moved(flown, "cf3", [FAULT + 5], [0.5, 0.0, 0.0]))


def test_the_fence():
    assert "cf4 0.40 m beyond the fence's margin" in broken(moved(made_up(), "cf4", [60], [0.0, 0.0, 1.3]))
    flown = made_up("dead motor", reason="cf2: tilts")
    assert broken(moved(flown, "cf2", [60], [0.0, -0.8 - FALLING + 0.1, 0.0])) == ""
    assert "cf2 (struck)" in broken(moved(flown, "cf2", [60], [0.0, -0.8 - FALLING - 0.1, 0.0]))


def test_who_is_cut_off_is_judged_for_a_while_and_may_hover():
    flown = made_up("dead dongle")
    away, late = [0.0, 0.0, 2.0], FAULT + round(10 * BLIND)
    assert broken(moved(flown, "cf2", [late + 1], away)) == ""
    assert "cf2" in broken(moved(flown, "cf2", [late - 1], away))
    hovering = moved(flown, "cf2", slice(100, None), [0.0, 0.0, 0.5])
    assert broken(replace(hovering, turning=hovering.position[:, :, 2] > 0.0)) == ""
    hovering = moved(flown, "cf3", slice(100, None), [0.0, 0.0, 0.5])
    turning = hovering.position[:, :, 2] > 0.0
    assert "cf3 at (1.90, 0.50, 0.50) m in the end" in broken(replace(hovering, turning=turning))


def test_whose_link_comes_back_has_to_land():
    hovering = moved(made_up("silence"), "cf2", slice(100, None), [0.0, 0.0, 0.5])
    turning = hovering.position[:, :, 2] > 0.0
    assert "cf2 at (1.30, 0.50, 0.50) m in the end" in broken(replace(hovering, turning=turning))


def test_the_log():
    flown = made_up()
    fault, end = flown.log.events

    def of(log, *events):
        return broken(replace(flown, log=SimpleNamespace(**vars(flown.log) | log | {"events": events})))

    assert of({}, fault, end) == ""
    assert "log: complete is False" in of({"complete": False}, fault, end)
    assert "a second is missing" in of({"problems": ("a second is missing",)}, fault, end)
    assert "ends while landing" in of({}, fault, replace(end, text="landing"))
    assert "nothing of the fault" in of({}, end)


def test_what_is_said():
    assert "verdict PASS of a flight that is aborted" in broken(made_up(level=Level.PASS))
    assert "verdict FAIL of a flight that is completed" in broken(made_up(phase=Phase.LANDED, reason=""))
    assert broken(made_up(phase=Phase.LANDED, reason="", level=Level.WARN)) == ""
    assert broken(made_up("weak motor", phase=Phase.LANDED, reason="")) == ""
    assert broken(made_up("brief swap", phase=Phase.LANDED, reason="", finding="marker swap")) == ""
    assert "does not say what went wrong" in broken(made_up(reason="cf2 is unhappy"))
    assert "does not say with whom" in broken(made_up(reason="link lost"))


def test_nobody_flies_who_was_called_off():
    flown = made_up(reason="")
    refused = PreflightError("cf2: link: silent", ())
    assert "somebody was in the air" in broken(replace(flown, ended=refused))


def test_cases_have_names_of_their_own_and_are_the_same_again():
    cases, again = ([*matrix(), *map(sequence, range(200))] for _ in range(2))
    assert cases == again
    assert len({case.name for case in cases}) == len(cases) >= 60 + 200
