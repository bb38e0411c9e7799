"""Commands that are lost, refused, or answered and not carried out, in whole flights on the simulated radio."""

import functools

import numpy as np
import pytest

from deploy.phases import Phase
from deploy.radio import highlevel
from deploy.radio.drone import Drone
from deploy.radio.requests import Reply, Requests
from tests.deploy.flight_bench import fly_watched, gentle, on_the_ground, small_mission, small_plan


@pytest.fixture
def bench(tmp_path, cache):
    """Flies in this test's folder; see ``fly_watched``."""
    return functools.partial(fly_watched, tmp_path, cache)


def start_instead(monkeypatch, other):
    """cf2 is sent another command than that to start its trajectory."""
    honest = Drone.send

    def send(drone, command):
        swapped = drone.name == "cf2" and command.what == "start trajectory"
        return honest(drone, other if swapped else command)

    monkeypatch.setattr(Drone, "send", send)


def test_a_refused_start_brings_everybody_down(bench, monkeypatch):
    start_instead(monkeypatch, highlevel.takeoff(0.6, 1.0))  # from hover: refused with 1
    outcome, ready, truth = bench()
    assert outcome.phase is Phase.ABORTED
    assert "trajectory start: cf2: refused by the planner" in outcome.reason
    assert all(outcome.landed.values())
    assert on_the_ground(ready)
    assert gentle(truth)


def test_a_start_that_is_accepted_and_not_flown_is_noticed(bench, monkeypatch):
    start_instead(monkeypatch, highlevel.start_trajectory(9))  # undefined: the firmware says 0 and does nothing
    outcome, _, truth = bench()
    assert outcome.phase is Phase.ABORTED
    assert "m from where it should be" in outcome.reason
    assert all(outcome.landed.values())
    assert gentle(truth)


def spoil(monkeypatch, command, answer):
    """cf1's first command of a kind does not reach the drone; ``answer`` comes back, or nothing."""
    honest, spoilt = Requests.send, []

    def send(link, request):
        if request.what != command or link._name != "cf1" or spoilt:
            return honest(link, request)
        spoilt.append(request)
        reply = Reply(request, link._now())
        if answer is None:
            link._pending.setdefault(request.key, []).append(reply)
        else:
            reply.fill(request.payload[:3] + bytes([answer]), link._now())
        return reply

    monkeypatch.setattr(Requests, "send", send)


def deafen(monkeypatch, code):
    """cf1's first answer to a command is lost; the command itself arrives."""
    honest, lost = Requests._incoming, []

    def incoming(link, packet):
        if packet.port == highlevel.PORT and packet.data[0] == code and link._name == "cf1" and not lost:
            lost.append(packet)
        else:
            honest(link, packet)

    monkeypatch.setattr(Requests, "_incoming", incoming)
    return lost


def test_a_start_that_is_lost_is_repeated(bench, monkeypatch):
    spoil(monkeypatch, "start trajectory", None)
    outcome, _, _ = bench()
    assert outcome.phase is Phase.LANDED
    assert any("repeated once" in warning for warning in outcome.warnings)
    assert max(outcome.largest_error.values()) < 0.15


def test_a_start_that_would_be_too_late_is_not_repeated(bench, monkeypatch):
    spoil(monkeypatch, "start trajectory", None)
    outcome, _, truth = bench(small_plan(small_mission(tracking_limit=0.06)))
    assert outcome.phase is Phase.ABORTED
    assert any("ms late: it would be up to 0.0" in warning for warning in outcome.warnings)
    assert all(outcome.landed.values())
    assert gentle(truth)


def test_a_start_whose_answer_is_lost_is_not_repeated(bench, monkeypatch):
    lost = deafen(monkeypatch, 0x0D)
    outcome, _, _ = bench()
    assert lost
    assert outcome.phase is Phase.LANDED
    assert any("not answered, but it flies" in warning for warning in outcome.warnings)
    assert max(outcome.largest_error.values()) < 0.05


@pytest.mark.parametrize("answer", [highlevel.BUSY, None])
def test_a_take_off_that_is_not_taken_is_repeated(bench, monkeypatch, answer):
    spoil(monkeypatch, "take-off", answer)
    outcome, _, truth = bench()
    assert outcome.completed, outcome
    assert np.abs(truth[:, 0, 2] - truth[:, 1, 2]).max() < 0.15


def test_a_take_off_whose_answer_is_lost_is_no_refusal(bench, monkeypatch):
    lost = deafen(monkeypatch, 0x07)
    outcome, _, _ = bench()
    assert lost
    assert outcome.completed, outcome
