"""Requests, memories, parameters, telemetry and fleet, against a scripted drone."""

import math
import struct
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from deploy.clock import SystemClock
from deploy.errors import CommandRefused, LinkError, UploadError
from deploy.radio import highlevel, memory, parameters
from deploy.radio.fleet import Fleet, FleetError
from deploy.radio.memory import MemoryInfo
from deploy.radio.parameters import Parameter
from deploy.radio.ping import Pings
from deploy.radio.requests import Request, Requests
from deploy.radio.supervisor import BITS, Supervisor
from deploy.radio.telemetry import BLOCKS, TICK_WRAP, Sample, to_record, unwrap

SIZES = {"float": 4, "FP16": 2, "uint16_t": 2, "": 1}
INFO = MemoryInfo(7, 0x12, 4096)


class Scripted:
    """Stands in for cflib's Crazyflie; ``answers(port, channel, payload)`` yields what comes back."""

    def __init__(self, answers):
        self.link = object()
        self.answers, self.callbacks, self.sent = answers, [], []

    def add_port_callback(self, port, callback):
        self.callbacks.append((port, callback))

    def send_packet(self, packet):
        self.sent.append(bytes(packet.data))
        for channel, data in self.answers(packet.port, packet.channel, bytes(packet.data)):
            self.hear(packet.port, channel, data)

    def hear(self, port, channel, data):
        packet = type("Packet", (), {"port": port, "channel": channel, "data": bytearray(data)})
        for on, callback in self.callbacks:
            if on == port:
                callback(packet)


def requests(answers):
    scripted = Scripted(answers)
    return scripted, Requests(scripted, lambda: 1.5, "cf1")


def echo(extra):
    return lambda port, channel, data: [(channel, data[:3] + extra)]


def test_an_answer_carries_code_and_time():
    _, link = requests(echo(b"\x10"))
    reply = link.send(highlevel.takeoff(0.6, 2.0))
    assert reply.here
    assert highlevel.return_code(reply.payload) == highlevel.BUSY
    assert (reply.sent, reply.arrived) == (1.5, 1.5)
    assert "supervisor" in highlevel.meaning(highlevel.BUSY)


def test_foreign_answers_do_not_count_and_one_answer_serves_equal_requests():
    scripted, link = requests(lambda *_: [])
    first, second = link.send(highlevel.stop()), link.send(highlevel.stop())
    scripted.hear(8, 0, b"\x07\x00\x00\x00")
    scripted.hear(9, 0, b"\x03\x00\x00")
    assert not first.here
    scripted.hear(8, 0, b"\x03\x00\x00")
    assert first.here
    assert second.here


def test_a_lost_packet_is_repeated():
    tries = []

    def answer(port, channel, data):
        tries.append(data)
        return [(channel, data + b"\x00")] if len(tries) == 3 else []

    _, link = requests(answer)
    link.ask(Request(4, 1, b"\x07abcd", b"\x07abcd", "read"), timeout=0.01)
    assert len(tries) == 3


def test_silence_ends_in_a_link_error_with_a_name():
    scripted, link = requests(lambda *_: [])
    with pytest.raises(LinkError, match="cf1: land: no answer to 2 requests"):
        link.ask(highlevel.land(0.0, 1.0), timeout=0.01, tries=2)
    scripted.link = None
    with pytest.raises(LinkError, match="cf1: land: the link is gone"):
        link.ask(highlevel.land(0.0, 1.0))


def test_pings_measure_round_trips_and_count_what_was_lost():
    clock, answering = [0.0], [True]
    scripted = Scripted(lambda port, channel, data: [(channel, data)] if answering[0] else [])
    pings = Pings(Requests(scripted, lambda: clock[0], "cf1"))
    assert math.isnan(pings.latency)
    answering[0] = False
    pings.ping()
    clock[0] = 0.03
    scripted.hear(15, 0, b"\x00" + bytes(8))  # cflib's own ping
    scripted.hear(15, 0, scripted.sent[-1])
    answering[0] = True
    pings.ping()
    assert pings.latency == pytest.approx(30.0)
    answering[0] = False
    pings.ping()
    pings.ping()
    assert pings.lost == 1
    assert all(len(packet) == 9 for packet in scripted.sent)


def storage(size=4096, status=0):
    held = bytearray(size)

    def answer(port, channel, data):
        identifier, address = struct.unpack_from("<BI", data)
        head = struct.pack("<BIB", identifier, address, status)
        if channel == 2:
            held[address : address + len(data) - 5] = data[5:]
            return [(2, head)]
        return [(1, head + held[address : address + data[5]])]

    return answer


@given(st.binary(min_size=0, max_size=200), st.integers(0, 100))
def test_memory_comes_back_as_it_was_written(data, address):
    _, link = requests(storage())
    link.converse(memory.writing(INFO, address, data))
    assert link.converse(memory.reading(INFO, address, len(data))) == data


def test_a_chunk_is_never_longer_than_the_firmware_bears():
    scripted, link = requests(storage())
    link.converse(memory.writing(INFO, 0, bytes(100)))
    link.converse(memory.reading(INFO, 0, 100))
    assert max(len(packet) for packet in scripted.sent) == 29
    assert {packet[5] for packet in scripted.sent if len(packet) == 6} == {24, 4}


@pytest.mark.parametrize("conversation", [memory.writing(INFO, 0, b"x"), memory.reading(INFO, 0, 1)])
def test_a_memory_error_is_raised(conversation):
    _, link = requests(storage(status=5))
    with pytest.raises(UploadError, match="error 5"):
        link.converse(conversation)


def registers(change=lambda data: data):
    held = {}

    def answer(port, channel, data):
        if channel == 2:
            held[data[:2]] = change(data[2:])
            return [(2, data)]
        return [(1, data[:2] + b"\x00" + held[data[:2]])]

    return answer


@given(st.floats(-1e6, 1e6))
def test_a_parameter_is_read_back_in_its_own_type(value):
    _, link = requests(registers())
    held = parameters.write(link, Parameter("a.b", 3, "<f", False), value)
    assert held == struct.unpack("<f", struct.pack("<f", value))[0]


def test_a_parameter_that_is_not_held_is_refused():
    _, link = requests(registers(lambda data: b"\x01"))
    with pytest.raises(CommandRefused, match=r"a\.b: wrote 2, the drone holds 1"):
        parameters.write(link, Parameter("a.b", 3, "<B", False), 2)
    assert parameters.write(link, Parameter("a.b", 3, "<B", False), 2, compare=False) == 1


@pytest.mark.parametrize(("form", "value"), [("<B", 256), ("<B", -1), ("<B", 1.5), ("<h", 40000)])
def test_a_value_that_does_not_fit_is_refused(form, value):
    with pytest.raises(CommandRefused, match=r"a\.b"):
        Parameter("a.b", 3, form, False).encode(value)


def test_log_blocks_fit_into_one_packet_each():
    for variables in BLOCKS.values():
        assert sum(SIZES[kind] for _, kind in variables) <= 26
        assert len(variables) <= 9


@given(st.integers(0, 1 << 40), st.integers(-1000, 5_000_000))
def test_the_drones_clock_is_continued_past_its_wrap(previous, step):
    true = max(0, previous + step)
    assert unwrap(true % TICK_WRAP, previous) == true


def test_records_have_si_units():
    values = dict.fromkeys((name for name, _ in BLOCKS["estimate"]), 0.0)
    record = to_record(Sample("estimate", 2.0, 7, {**values, "stateEstimate.pitch": 90.0, "stateEstimate.vx": 0.5}))
    assert record.rpy == pytest.approx((0.0, -math.pi / 2, 0.0))
    assert record.velocity == (0.5, 0.0, 0.0)


@given(st.integers(0, 0xFFF))
def test_the_supervisor_word_is_decoded_bit_by_bit(bits):
    word = Supervisor(bits)
    assert set(word.names) == {name for i, name in enumerate(BITS) if bits >> i & 1}
    assert word.ready <= (word.armed and word.can_fly and not (word.tumbled or word.locked or word.crashed))
    assert Supervisor(0x020E).ready


class Named:
    def __init__(self, name):
        self.name = name


def test_every_failure_of_a_fleet_is_reported_and_the_loop_goes_on_meanwhile():
    fleet, gate, ticks = Fleet([Named("a"), Named("b"), Named("c")], SystemClock()), threading.Event(), []

    def action(drone):
        assert gate.wait(5.0)
        if drone.name != "b":
            raise LinkError(f"{drone.name}: no answer")
        return drone.name

    def tick():
        ticks.append(1)
        gate.set()

    with pytest.raises(FleetError, match="landing failed on 2 of 3 drones: a: no answer; c: no answer") as caught:
        fleet.each("landing", action, tick)
    assert set(caught.value.errors) == {"a", "c"}
    assert ticks
    assert fleet.each("landing", action, tick, among=["b"]) == {"b": "b"}


def test_a_bug_in_an_action_is_not_dressed_up():
    with pytest.raises(ZeroDivisionError):
        Fleet([Named("a")], SystemClock()).each("x", lambda drone: 1 / 0, lambda: None)
