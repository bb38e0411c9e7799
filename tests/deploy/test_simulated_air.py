"""The modelled radio: bandwidth, latency, losses, queues, and when a link counts as lost."""

import dataclasses
import functools
import itertools
import tempfile
from pathlib import Path

import pytest
from cflib.crazyflie import Crazyflie
from cflib.crazyflie.syncCrazyflie import SyncCrazyflie
from hypothesis import given
from hypothesis import strategies as st

from deploy.clock import VirtualClock
from deploy.radio.drone import Drone
from deploy.radio.fleet import Fleet
from deploy.radio.simulated.air.air import Air
from deploy.radio.simulated.air.fading import Fading
from deploy.radio.simulated.air.line import LOST, STUCK
from deploy.radio.simulated.air.model import AirModel, Station, rate_limit_of, stations
from deploy.radio.simulated.driver import unregister
from deploy.radio.simulated.swarm import SimulatedSwarm
from missions.schema import Radio
from tests.contracts import link
from tests.deploy.flight_bench import small_mission
from tests.deploy.ideal_world import IdealWorld

CLEAN = AirModel(packet_rate=500.0, loss=0.0, uplink=0.003, downlink=0.001)
COMMAND, POSE = 0x80, 0x61


class Echo:
    """A drone that notes when packets come, and answers them if told to."""

    def __init__(self, answers=0):
        self.is_alive, self.heard, self.line, self._answers = True, [], None, answers

    def receive(self, header, data):
        self.heard.append((self.line.t, data))
        for _ in range(self._answers):
            self.line.answer(header >> 4, 0, data)


class Bench:
    """Clients and drones on the air, 10 ms at a time."""

    def __init__(self, *drones, model=CLEAN, stations=None, seed=0, held=lambda: False, rate_limit=None):
        self.drones = {f"cf{i + 1}": drone for i, drone in enumerate(drones)}
        self.air = Air(model, stations or {}, seed=seed, held=held)
        self.air.attach(self.drones)
        self.t, self.got, self.lost = 0.0, {name: [] for name in self.drones}, []
        for name, line in self.air.lines.items():
            self.drones[name].line = line
            line.open(functools.partial(self._deliver, name), self.lost.append, rate_limit)

    def _deliver(self, name, port, channel, data):
        self.got[name].append((self.air.lines[name].t, data))

    def send(self, name, *packets, header=COMMAND):
        for packet in packets:
            self.air.lines[name].send(header, packet)

    def advance(self, seconds):
        for _ in range(round(seconds * 100)):
            self.t += 0.01
            self.air.advance(round(self.t, 2))
            self.air.hand_out(round(self.t, 2))


def numbers(count):
    return [k.to_bytes(2, "little") for k in range(count)]


def test_a_packet_takes_an_exchange_and_the_latency_and_its_answer_rides_in_the_next_acknowledgement():
    bench = Bench(Echo(answers=1))
    bench.send("cf1", b"x")
    bench.advance(0.02)
    ((arrived, _),) = bench.drones["cf1"].heard
    ((answered, _),) = bench.got["cf1"]
    assert arrived == pytest.approx(0.002 + 0.003)
    assert answered == pytest.approx(0.01)  # exchanged by 9 ms at the latest, and seen at the end of the tick


def test_drones_of_a_dongle_share_its_exchanges_and_others_do_not():
    at = {"cf1": Station("0"), "cf2": Station("0"), "cf3": Station("1")}
    bench = Bench(Echo(), Echo(), Echo(), stations=at)
    for name in bench.drones:
        bench.send(name, *numbers(1000))
    bench.advance(1.0)
    first, second, third = (len(drone.heard) for drone in bench.drones.values())
    assert first + second == pytest.approx(500, abs=5)
    assert abs(first - second) <= 1
    assert third == pytest.approx(500, abs=5)


def test_the_drone_says_one_packet_an_exchange():
    bench = Bench(drone := Echo())
    for packet in numbers(100):
        drone.line.answer(0, 0, packet)
    bench.advance(0.1)
    assert len(bench.got["cf1"]) == pytest.approx(50, abs=2)


def test_the_firmwares_queue_fills_and_what_comes_then_is_dropped():
    bench = Bench(drone := Echo())
    for packet in numbers(250):
        drone.line.answer(5, 2, packet)
    bench.advance(1.0)
    assert [data for _, data in bench.got["cf1"]] == numbers(200)
    assert drone.line.dropped == 50


@given(st.floats(0.0, 0.6), st.integers(0, 100))
def test_losses_make_packets_late_but_lose_double_or_swap_none(loss, seed):
    bench = Bench(Echo(answers=1), model=AirModel(loss=loss), seed=seed)
    bench.send("cf1", *numbers(50))
    bench.advance(2.0)
    assert [data for _, data in bench.drones["cf1"].heard] == numbers(50)
    assert [data for _, data in bench.got["cf1"]] == numbers(50)
    assert not bench.lost


def test_losses_cost_time_quality_and_signal():
    ends, qualities, signals = [], [], []
    for loss in (0.0, 0.5):
        bench = Bench(Echo())
        bench.air.lines["cf1"].disturb(loss)
        bench.send("cf1", *numbers(200))
        bench.advance(1.5)
        ends.append(bench.drones["cf1"].heard[-1][0])
        qualities.append(bench.air.lines["cf1"].quality)
        signals.append(bench.air.rssi("cf1"))
    assert ends[1] > 1.2 * ends[0]
    assert qualities[0] == 100.0
    assert 80.0 < qualities[1] < 97.0
    assert signals[1] > signals[0] + 10.0


@pytest.mark.parametrize(("rate", "burst"), [(0.1, 0.02), (0.5, 0.1)])
def test_bursts_have_the_share_and_the_length_asked_for(rate, burst):
    fading = Fading("seed", 0.0)
    fading.disturb(0.0, rate, burst)
    fails = [fading.fails(0.001 * k) for k in range(400_000)]
    begun = sum(b and not a for a, b in itertools.pairwise(fails))
    assert sum(fails) / len(fails) == pytest.approx(rate, rel=0.15)
    assert fading.mean_loss == pytest.approx(rate)
    assert 0.001 * sum(fails) / begun == pytest.approx(burst, rel=0.15)
    fading.calm()
    assert not any(fading.fails(400.0 + 0.001 * k) for k in range(1000))


def test_a_silent_drone_is_lost_after_a_hundred_exchanges_and_may_come_back():
    bench = Bench(Echo(), Echo())
    line = bench.air.lines["cf1"]
    end = line.silence()
    bench.advance(0.3)
    assert not bench.lost  # 100 exchanges of 3.5 ms, and the other drone is polled in between
    bench.advance(0.2)
    assert bench.lost == [LOST]
    bench.send("cf1", b"too late")
    end()
    bench.advance(0.5)
    assert not bench.drones["cf1"].heard
    line.open(lambda *_: None, bench.lost.append)
    bench.send("cf1", b"again")
    bench.advance(0.1)
    assert [data for _, data in bench.drones["cf1"].heard] == [b"again"]
    assert bench.lost == [LOST]


def test_a_drone_that_reboots_is_silent():
    bench = Bench(Echo())
    bench.drones["cf1"].is_alive = False
    bench.advance(1.0)
    assert bench.lost == [LOST]


def test_a_short_silence_is_survived():
    bench = Bench(Echo())
    end = bench.air.lines["cf1"].silence()
    bench.send("cf1", *numbers(3))
    bench.advance(0.2)
    end()
    bench.advance(0.1)
    assert [data for _, data in bench.drones["cf1"].heard] == numbers(3)
    assert not bench.lost


def test_a_rate_limit_holds_and_what_waits_too_long_is_a_lost_link():
    bench = Bench(Echo(), rate_limit=20.0)
    bench.send("cf1", *numbers(20))
    bench.advance(0.5)
    assert len(bench.drones["cf1"].heard) == pytest.approx(10, abs=1)
    slow = Bench(Echo(), rate_limit=1.0)
    slow.send("cf1", *numbers(5))
    slow.advance(3.0)
    assert slow.lost == [STUCK]


def test_another_channel_has_to_be_tuned_to():
    tuned = {"cf1": Station("0", "80/2M"), "cf2": Station("0", "90/2M")}
    bench = Bench(Echo(), Echo(), stations=tuned, model=AirModel(loss=0.0, retune=0.002))
    for name in bench.drones:
        bench.send(name, *numbers(500))
    bench.advance(1.0)
    assert sum(len(drone.heard) for drone in bench.drones.values()) == pytest.approx(250, abs=5)


def test_a_position_that_still_waits_gives_way_to_a_newer_one_and_commands_do_not():
    bench = Bench(drone := Echo())
    bench.send("cf1", b"old", b"new", header=POSE)
    bench.send("cf1", b"a", b"a")
    bench.send("cf1", b"newest", header=POSE)
    bench.advance(0.05)
    assert [data for _, data in drone.heard] == [b"new", b"a", b"a", b"newest"]


def test_while_time_is_held_packets_arrive_at_once_and_keep_their_order():
    work = []
    bench = Bench(drone := Echo(answers=1), held=lambda: bool(work))
    bench.send("cf1", b"before")
    work.append("an upload")
    bench.send("cf1", b"first", b"second")
    assert [data for _, data in drone.heard] == [b"before", b"first", b"second"]
    assert [data for _, data in bench.got["cf1"]] == [b"before", b"first", b"second"]
    bench.air.lines["cf1"].silence()
    bench.send("cf1", b"third")
    assert bench.lost == [LOST]


def asked_at_once(drones, questions, model, seed=0):
    bench = Bench(*(Echo(answers=1) for _ in range(drones)), model=model, seed=seed, held=lambda: True)
    for name in bench.drones:
        bench.send(name, *[b"?"] * questions)
    return bench


def asked_one_after_another(drones, questions, model):
    """How long it takes everybody to ask so many questions, each when the last is answered [s]."""
    bench = Bench(*(Echo(answers=1) for _ in range(drones)), model=model)

    def ask_again(name, port, channel, data):
        bench.got[name].append(data)
        if len(bench.got[name]) < questions:
            bench.send(name, b"?")

    for name, line in bench.air.lines.items():
        line.open(functools.partial(ask_again, name), bench.lost.append)
        bench.send(name, b"?")
    while any(len(got) < questions for got in bench.got.values()):
        bench.t += 0.0005
        bench.air.advance(bench.t)
        bench.air.hand_out(bench.t)
    return bench.t


@pytest.mark.parametrize("loss", [0.0, 0.3])
@pytest.mark.parametrize("drones", [1, 2, 8])
def test_a_conversation_while_time_is_held_owes_what_it_takes_on_the_air(drones, loss):
    model = dataclasses.replace(CLEAN, loss=loss)
    bench = asked_at_once(drones, 100, model)
    assert bench.air.owed() == pytest.approx(asked_one_after_another(drones, 100, model), rel=0.15)
    assert bench.air.owed() == 0.0  # paid


def test_what_is_owed_repeats_and_dongles_do_not_wait_for_each_other():
    model = dataclasses.replace(CLEAN, loss=0.2)
    assert asked_at_once(3, 50, model, seed=4).air.owed() == asked_at_once(3, 50, model, seed=4).air.owed()
    assert asked_at_once(3, 50, model, seed=4).air.owed() != asked_at_once(3, 50, model, seed=5).air.owed()
    both = Bench(Echo(1), Echo(1), held=lambda: True, stations={"cf1": Station("0"), "cf2": Station("1")})
    both.send("cf1", b"?")
    both.send("cf2", b"?", b"?")
    assert both.air.owed() == pytest.approx(2 * (0.002 + 0.003 + 0.002 + 0.001))
    limited = Bench(Echo(1), held=lambda: True, rate_limit=100)
    limited.send("cf1", b"?")
    assert limited.air.owed() == pytest.approx(0.010 + 0.003 + 0.010 + 0.001)


def test_nothing_gets_through_while_time_is_held_if_every_attempt_fails():
    bench = Bench(drone := Echo(answers=1), held=lambda: True)
    bench.air.lines["cf1"].disturb(1.0)
    bench.send("cf1", b"?")
    assert bench.lost == [LOST]
    assert drone.heard == []
    assert bench.air.owed() == pytest.approx(100 * 0.002 + 400 * 0.0005 + 0.003)


def test_connections_take_the_air_time_of_their_packets_and_the_loop_turns_meanwhile():
    """Cold, then with the tables of contents cached; ten drones share a dongle."""
    clock = VirtualClock(patience=10.0)
    air = Air(AirModel(), {}, held=lambda: clock.held)
    names = [f"cf{i}" for i in range(10)]
    with (
        tempfile.TemporaryDirectory() as cache,
        SimulatedSwarm(
            names, IdealWorld([(float(i), 0.0, 0.0) for i in range(10)]), clock, label="cold", air=air
        ) as swarm,
    ):
        fleet = Fleet([Drone(name, uri, clock, Path(cache)) for name, uri in swarm.uris().items()], clock)

        def took(what, act):
            turns, began = [], clock.now()

            def tick():
                clock.sleep_until(clock.now() + 0.01)
                turns.append(clock.now())

            fleet.each(what, act, tick)
            assert len(turns) == pytest.approx((clock.now() - began) / 0.01, abs=1)
            return clock.now() - began

        def drop(drone):
            drone.close(force=True)

        cold = took("connecting", Drone.connect)
        took("closing", drop)
        cached = took("connecting", Drone.connect)
        took("closing", drop)
    unregister()
    assert 25.0 < cold < 40.0  # 8160 questions and as many answers, 500 a second
    assert 4.0 < cached < 7.0  # 1290


def test_latency_comes_and_goes_without_swapping_packets():
    bench = Bench(drone := Echo())
    end = drone.line.slow_down(0.05)
    bench.send("cf1", b"slow")
    bench.advance(0.01)
    end()
    bench.send("cf1", b"fast")
    bench.advance(0.1)
    assert [data for _, data in drone.heard] == [b"slow", b"fast"]
    assert drone.heard[0][0] == pytest.approx(0.055)


def test_the_same_seed_loses_the_same_packets():
    def times(seed):
        bench = Bench(Echo(), Echo(answers=2), model=AirModel(loss=0.3), seed=seed)
        for name in bench.drones:
            bench.send(name, *numbers(100))
        bench.advance(2.0)
        return [drone.heard for drone in bench.drones.values()], bench.got

    assert times(1) == times(1)
    assert times(1) != times(2)


def test_stations_are_those_of_the_uris_or_as_many_a_dongle_as_the_mission_says():
    mission = small_mission()
    a, b = mission.robots
    a = dataclasses.replace(a, uri="radio://1/80/2M/E7E7E7E701?rate_limit=100")
    assert stations(dataclasses.replace(mission, robots=(a, b))) == {
        "cf1": Station("1", "80/2M", 100.0),
        "cf2": Station("0"),
    }
    alone = dataclasses.replace(mission, radio=Radio(drones_per_dongle=1))
    assert [station.dongle for station in stations(alone).values()] == ["0", "1"]
    assert rate_limit_of("rate_limit=0") is rate_limit_of("safelink=1") is None


def test_cflib_meets_the_contract_over_the_modelled_radio():
    clock = VirtualClock(patience=10.0)
    air = Air(AirModel(loss=0.05), {}, held=lambda: clock.held)
    with SimulatedSwarm(["cf1"], IdealWorld([(0.0, 0.0, 0.0)]), clock, label="air", air=air) as swarm:
        uri = swarm.uris()["cf1"] + "?rate_limit=200"
        with clock.hold():
            link.connects_and_becomes_fully_connected(uri, clock.sleep_until)
            link.trajectory_memory_holds_what_was_written(uri, clock.sleep_until)
            link.flight_commands_are_answered_with_a_return_code(uri, clock.sleep_until)
    unregister()


def test_pings_of_cflib_do_not_touch_the_air():
    clock = VirtualClock(patience=10.0)
    air = Air(CLEAN, {}, held=lambda: clock.held)
    with SimulatedSwarm(["cf1"], IdealWorld([(0.0, 0.0, 0.0)]), clock, label="pings", air=air) as swarm:
        with clock.hold():
            scf = SyncCrazyflie(swarm.uris()["cf1"], cf=Crazyflie())
            scf.open_link()
        clock.sleep_until(0.1)
        waiting = air.lines["cf1"].due
        for _ in range(5):
            scf.cf.link_statistics.latency.ping()
        assert air.lines["cf1"].due == waiting
        assert swarm.settle(5.0)
        assert len(scf.cf.link_statistics.latency._latencies) >= 5
        with clock.hold():
            scf.close_link()
    unregister()
