"""Flights in legs that are uploaded in flight: a good one, and everything that may go wrong with a leg."""

import functools
import struct

import numpy as np
import pytest

import deploy.flight.legs
from deploy.errors import LinkError, UploadError
from deploy.flight.talk import Talk
from deploy.flightlog.reader import read_log
from deploy.phases import Phase
from deploy.radio import highlevel, memory
from deploy.radio.drone import Drone
from deploy.radio.requests import Reply
from planner.trajectory.encode import decode
from planner.trajectory.encoded import MEMORY_SIZE
from planner.trajectory.timeline import Timeline
from tests.deploy.flight_bench import fly_on, stage
from tests.deploy.long_flight import long_plan

PLAN = long_plan()
SWITCHES = Timeline.of(PLAN.trajectories["cf1"]).times


def run(folder, cache, prepare=lambda ready: None, plan=PLAN, **kwargs):
    """Fly; returns the outcome, the events of the log, and the truth (n, 2, 3) every 0.05 s with its times."""
    with stage(folder, plan) as ready:
        truth, times = [], []
        ready.world.every(0.05, lambda t: (truth.append(ready.world.positions), times.append(t)))
        prepare(ready)
        outcome = fly_on(ready, plan, cache, **kwargs)
        spinning = bool(ready.world.motors.any())
        assert ready.clock.stalls == 0
    assert not spinning
    return outcome, read_log(ready.log.path).events, np.array(truth), np.array(times)


@pytest.fixture
def bench(tmp_path, cache):
    """Flies in this test's folder; see ``run``."""
    return functools.partial(run, tmp_path, cache)


def named(events, name):
    return [event for event in events if event.name == name]


def everybody_came_down(outcome, events, truth, *, within):
    """An abort in the named window of mission time [s], after which all land gently."""
    (begun,), (ended,) = named(events, "mission_start"), named(events, "abort")
    assert outcome.phase is Phase.ABORTED
    assert all(outcome.landed.values())
    assert within[0] <= ended.t - begun.t <= within[1]
    assert np.diff(truth[:, :, 2], axis=0).min() > -0.1  # 2 m/s downwards
    assert np.linalg.norm(truth[:, 0] - truth[:, 1], axis=1).min() > 0.8


def test_three_legs_are_flown_as_one_trajectory(bench):
    assert [leg.offset for leg in PLAN.trajectories["cf1"].legs] == [0, 2048, 0]
    assert PLAN.trajectories["cf1"].size > MEMORY_SIZE
    assert PLAN.certificate.passed
    stages = []
    outcome, events, truth, times = bench(stages.append)
    assert outcome.completed, outcome
    assert not outcome.warnings
    assert max(outcome.largest_error.values()) < 0.03
    begun = named(events, "mission_start")[0].t
    for number, robot in enumerate(("cf1", "cf2")):
        starts = [event for event in named(events, "leg_start") if event.robot == robot]
        assert [event.t - begun for event in starts] == pytest.approx(SWITCHES[:-1], abs=0.015)
        assert all(abs(event.value) <= PLAN.mission.radio.jitter for event in starts)
        (upload,) = (event for event in named(events, "leg_upload") if event.robot == robot)
        assert SWITCHES[1] < upload.t - begun < SWITCHES[2] - 0.5
        mission_time = times - begun
        inside = (mission_time >= 0.0) & (mission_time <= SWITCHES[-1])
        planned = decode(PLAN.trajectories[robot]).evaluate(mission_time[inside])[:, :3]
        assert np.linalg.norm(truth[inside, number] - planned, axis=1).max() < 0.05
        # Uploads keep nobody waiting: poses go out, and the loop writes references, as ever.
        series = read_log(stages[0].log.path).series
        for topic, period in (("pose", 0.02), ("reference", 0.1)):
            sent = series[f"/{robot}/{topic}"].t
            assert np.diff(sent[(sent > begun) & (sent < begun + SWITCHES[-1])]).max() < 2.0 * period


def in_flight(ready, robot, act):
    """Have ``act(address, data)`` change what a drone's trajectory memory gives once it was flown a while."""
    held = ready.swarm.drones[robot]._memory
    honest = held.read

    def read(address, length):
        data = honest(address, length)
        return act(address, data) if ready.clock.now() > 6.0 else data

    held.read = read


def test_a_leg_that_reads_back_differently_is_never_started(bench):
    def flipped(address, data):
        return bytes([data[0] ^ 1]) + data[1:] if (address, len(data)) == (240, 24) else data

    outcome, events, truth, _ = bench(lambda ready: in_flight(ready, "cf2", flipped))
    size = len(PLAN.trajectories["cf2"].legs[2].data)
    assert f"cf2: 1 of {size} bytes read back differ from what was written, first at 240" in outcome.reason
    everybody_came_down(outcome, events, truth, within=(SWITCHES[1] + 1.0, SWITCHES[2] - 1.0))
    assert len(named(events, "leg_start")) == 4


def test_an_upload_that_is_late_lands_everybody_while_all_still_fly(bench, monkeypatch):
    monkeypatch.setattr(deploy.flight.legs, "request_rate", lambda mission: (40.0, 12.0))
    outcome, events, truth, _ = bench()
    assert "cf2: leg 3 of 3 is not in its memory 0.5 s before its start" in outcome.reason
    everybody_came_down(outcome, events, truth, within=(SWITCHES[2] - 0.52, SWITCHES[2] - 0.3))


def test_a_drone_that_stops_answering_uploads_lands_everybody(bench):
    def prepare(ready):
        drone = ready.swarm.drones["cf1"]
        honest = drone.receive

        def receive(header, data):
            if header >> 4 != memory.PORT or ready.clock.now() < 8.5:
                honest(header, data)

        drone.receive = receive

    outcome, events, truth, _ = bench(prepare)
    assert "cf1: write to memory 0 at" in outcome.reason
    assert "no answer to 6 requests" in outcome.reason
    everybody_came_down(outcome, events, truth, within=(SWITCHES[1], SWITCHES[2] - 0.5))


def instead(monkeypatch, robot, number, command):
    """One of a robot's starts (from 0) becomes another command; None: it is lost on the air."""
    honest, seen = Drone.send, []

    def send(drone, request):
        if drone.name == robot and request.what == "start trajectory":
            seen.append(request)
            if len(seen) == number + 1:
                return Reply(request, drone._link._clock.now()) if command is None else honest(drone, command)
        return honest(drone, request)

    monkeypatch.setattr(Drone, "send", send)


def test_a_start_that_is_refused_lands_everybody_from_the_end_of_the_leg(bench, monkeypatch):
    instead(monkeypatch, "cf2", 1, highlevel.takeoff(0.6, 1.0))  # from the air: refused with 1
    outcome, events, truth, _ = bench()
    assert "cf2: start of leg 2 of 3: refused by the planner" in outcome.reason
    everybody_came_down(outcome, events, truth, within=(SWITCHES[1], SWITCHES[1] + 0.1))


def test_a_start_that_is_not_heard_lands_everybody(bench, monkeypatch):
    instead(monkeypatch, "cf1", 1, None)
    outcome, events, truth, _ = bench()
    assert "cf1: start of leg 2 of 3: no answer, and the drone holds" in outcome.reason
    everybody_came_down(outcome, events, truth, within=(SWITCHES[1], SWITCHES[1] + 0.5))


def test_a_start_that_is_accepted_and_not_flown_never_has_the_held_half_overwritten(bench, monkeypatch):
    instead(monkeypatch, "cf1", 1, highlevel.start_trajectory(9))  # undefined: the firmware says 0 and does nothing
    outcome, events, truth, _ = bench()
    assert "leg 2 of 3: its start was accepted, but the drone holds" in outcome.reason
    everybody_came_down(outcome, events, truth, within=(SWITCHES[1], SWITCHES[1] + 0.5))


def test_a_start_whose_answer_is_lost_is_seen_in_telemetry(bench):
    lost = []

    def prepare(ready):
        drone = ready.swarm.drones["cf1"]
        honest = drone._send

        def send(port, channel, data):
            if port == highlevel.PORT and data[0] == 0x0D and ready.clock.now() > 6.0 and not lost:
                lost.append(data)
            else:
                honest(port, channel, data)

        drone._send = send
        drone._ports[highlevel.PORT].__self__._send = send

    outcome, events, _, _ = bench(prepare)
    assert lost
    assert outcome.completed, outcome
    assert len(named(events, "leg_start")) == 6


class Line:
    """A drone that answers, or not."""

    def __init__(self, answers=True):
        self.name, self.sent, self.forgotten, self._answers = "cf1", [], [], answers

    def send(self, request):
        reply = Reply(request, self.now)
        self.sent.append(request)
        if self._answers:
            reply.fill(request.payload[:5] + b"\0", self.now)
        return reply

    def resend(self, reply):
        reply.sent, reply.repeated = self.now, True
        self.sent.append(reply.request)

    def forget(self, reply):
        self.forgotten.append(reply)


def talk(line, data, ticks=200):
    conversation = Talk(line, memory.writing(memory.MemoryInfo(0, 0x12, 4096), 2048, data))
    for tick in range(ticks):
        line.now = tick * 0.01
        if conversation.over:
            return conversation
        conversation.step(line.now)
    return conversation


def test_a_talk_asks_for_one_thing_at_a_time_and_ends():
    line = Line()
    data = bytes(range(100))
    assert talk(line, data).over
    sent = [(struct.unpack_from("<I", r.payload, 1)[0], r.payload[5:]) for r in line.sent]
    assert [address for address, _ in sent] == [2048, 2072, 2096, 2120, 2144]
    assert b"".join(chunk for _, chunk in sent) == data


def test_a_talk_repeats_what_is_not_answered_and_gives_up():
    line = Line(answers=False)
    with pytest.raises(LinkError, match="cf1: write to memory 0 at 2048: no answer to 6 requests"):
        talk(line, bytes(24))
    assert len(line.sent) == 6
    assert len(line.forgotten) == 1


def test_a_refused_chunk_ends_the_talk():
    line = Line()
    line.send = lambda request: (reply := Reply(request, 0.0), reply.fill(request.payload[:5] + b"\5", 0.0))[0]
    with pytest.raises(UploadError, match="error 5"):
        talk(line, bytes(24))
