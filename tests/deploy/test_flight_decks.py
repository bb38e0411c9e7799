"""Decks in a flight: plugged in as the mission says, found by the drones' own word, and positions from them."""

import pytest

from deploy.errors import PreflightError
from deploy.flightlog.reader import read_log
from deploy.phases import Phase
from deploy.rehearsal import rehearse
from tests.deploy.flight_bench import fly_on, parsed, small_plan, small_text, stage


def plan_with(decks):
    return small_plan(parsed(small_text(*[f", decks: {decks}"] * 2)))


def test_robots_with_lighthouse_decks_position_themselves(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    outcome, path = rehearse(plan_with("[lighthouse4, led_ring]"), log_path=tmp_path / "flight.mcap")
    assert outcome.phase is Phase.LANDED
    checks = [event.text for event in read_log(path).events if event.name == "preflight" and event.robot == "cf1"]
    assert "decks: led_ring, lighthouse4 (allowed: lighthouse4, led_ring)" in checks
    assert any(text.startswith("positioning deck: led_ring, lighthouse4") for text in checks)
    assert not any(text.startswith("pose:") for text in checks)  # nobody sees them from outside
    assert max(outcome.largest_error.values()) < 0.1  # [m]


def test_a_deck_that_is_not_found_keeps_everybody_on_the_ground(tmp_path):
    with (
        stage(tmp_path, small_plan()) as ready,
        pytest.raises(PreflightError, match=r"cf1: decks: none \(allowed: flow2\); push the decks home") as caught,
    ):
        fly_on(ready, plan_with("[flow2]"))
    assert {check.robot for check in caught.value.checks if check.result == "failure"} == {"cf1", "cf2"}
