"""Delays of a flight: what counts, and where it is shown."""

import math
from types import MappingProxyType, SimpleNamespace

import pytest

from deploy.cli.flying import print_outcome
from deploy.flight.records import FlightOutcome
from deploy.flight.timing import Latency, Timing
from deploy.flightlog.reader import Event
from deploy.phases import Phase
from deploy.preflight import PreflightReport
from deploy.radio import highlevel
from deploy.radio.requests import Reply
from deploy.report.delays import delays_table


def answered(after, repeated=False):
    reply = Reply(highlevel.stop(), 1.0)
    reply.repeated = repeated
    reply.fill(b"\x03\0\0\0", 1.0 + after)
    return reply


def test_answers_count_unless_they_may_be_to_another_copy():
    timing = Timing()
    for after in (0.004, 0.010, 0.006):
        timing.answered("cf1", answered(after))
    timing.answered("cf1", answered(0.5, repeated=True))
    timing.answered("cf2", Reply(highlevel.stop(), 1.0))
    assert set(timing.latencies) == {"cf1"}
    latency = timing.latencies["cf1"]
    assert (latency.count, latency.median, latency.largest) == (3, pytest.approx(0.006), pytest.approx(0.010))
    assert str(latency) == "3 commands answered, 6.0 ms median, 10.0 ms most"
    assert math.isnan(timing.reaction)


def test_the_terminal_and_the_report_show_them(capsys):
    latencies = MappingProxyType({"cf1": Latency(3, 0.006, 0.010), "cf2": Latency(2, 0.005, 0.020)})
    outcome = FlightOutcome(
        Phase.ABORTED, "x", PreflightReport(), start_skew=0.0012, latencies=latencies, reaction=0.13
    )
    print_outcome(outcome)
    shown = " ".join(capsys.readouterr().err.split())
    assert (
        "starts within 1.2 ms; commands answered within 6.0 ms (median), 20.0 ms (most); reaction within 130 ms"
        in shown
    )
    events = [
        Event(1.0, "start_skew", "starts within 1.2 ms", value=0.0012),
        Event(2.0, "command_latency", "3 commands", robot="cf1", value=0.006),
        Event(3.0, "phase", "landed"),
    ]
    page = delays_table(SimpleNamespace(record=SimpleNamespace(events=events)))
    assert "start skew" in page
    assert "6.0" in page
    assert delays_table(SimpleNamespace(record=SimpleNamespace(events=events[2:]))) == ""
