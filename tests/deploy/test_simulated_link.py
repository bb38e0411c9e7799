"""The simulated radio through unmodified cflib: contract, handshake, settling, closing."""

import os
import queue
import sys
import threading
import time
from pathlib import Path

import cflib.crtp
import pytest
from cflib.crazyflie import Crazyflie
from cflib.crazyflie.log import LogConfig
from cflib.crazyflie.swarm import CachedCfFactory, Swarm
from cflib.crazyflie.syncCrazyflie import SyncCrazyflie
from cflib.crtp.crtpstack import CRTPPacket
from cflib.crtp.exceptions import WrongUriType
from cflib.crtp.radiodriver import RadioDriver

from deploy.clock import SystemClock, VirtualClock
from deploy.errors import LinkError
from deploy.radio.simulated.crazyflie import SimulatedCrazyflie
from deploy.radio.simulated.driver import SimulatedDriver, Traffic, register, unregister
from deploy.radio.simulated.swarm import SimulatedSwarm
from tests.contracts import link
from tests.deploy.ideal_world import IdealWorld
from tests.recordings import recording

GOLDEN = Path(__file__).parents[1] / "golden"


@pytest.fixture
def clock():
    return VirtualClock(patience=10.0)


@pytest.fixture
def swarm(clock):
    with SimulatedSwarm(["cf1", "cf2"], IdealWorld([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)]), clock, label="test") as swarm:
        yield swarm
    unregister()


@pytest.fixture
def uri(swarm):
    return swarm.uris()["cf1"]


@pytest.mark.parametrize("promise", link.PROMISES, ids=lambda promise: promise.__name__)
def test_contract(promise, uri, clock):
    promise(uri, lambda seconds: clock.sleep_until(clock.now() + seconds))


def test_contract_unarmed():
    with SimulatedSwarm(["cf"], IdealWorld([(0.0, 0.0, 0.0)]), label="unarmed", auto_arm=False) as swarm:
        link.an_unarmed_drone_refuses_to_take_off(swarm.uris()["cf"])


def test_contract_missing_drone(swarm):
    link.missing_drones_are_an_error("sim://test/nobody")


@pytest.mark.hardware
@pytest.mark.parametrize("promise", link.PROMISES, ids=lambda promise: promise.__name__)
def test_contract_on_hardware(promise):
    """The drone at ERGOFLIE_TEST_URI stands on the ground; it does not move."""
    if not any(issubclass(cls, RadioDriver) for cls in cflib.crtp.CLASSES):
        cflib.crtp.init_drivers()
    clock = SystemClock()
    promise(
        os.environ.get("ERGOFLIE_TEST_URI", "radio://0/80/2M/E7E7E7E7E7"),
        lambda seconds: clock.sleep_until(clock.now() + seconds),
    )


def test_recorded_handshake(monkeypatch, swarm):
    """Unmodified cflib exchanges the recorded packets in the recorded order (pings apart)."""
    swarm._drones["cf1"] = SimulatedCrazyflie("cf1", hardware=False)
    exchange = []
    send, deliver = SimulatedDriver.send_packet, SimulatedDriver._deliver

    def sent(driver, packet):
        if (packet.port, packet.channel) != (15, 0):
            exchange.append(f"tx {packet.port}:{packet.channel} {bytes(packet.data).hex()}")
        send(driver, packet)

    def delivered(driver, port, channel, data):
        if (port, channel) != (15, 0):
            exchange.append(f"rx {port}:{channel} {bytes(data).hex()}")
        deliver(driver, port, channel, data)

    monkeypatch.setattr(SimulatedDriver, "send_packet", sent)
    monkeypatch.setattr(SimulatedDriver, "_deliver", delivered)
    with SyncCrazyflie(swarm.uris()["cf1"], cf=Crazyflie()) as scf:
        scf.wait_for_params()
        got = list(exchange)
    assert got == (GOLDEN / "handshake.txt").read_text().splitlines()


def test_time_waits_until_callbacks_have_returned(uri, clock):
    """A slow callback does not lose or reorder anything: every row is there when sleep_until returns."""
    with SyncCrazyflie(uri, cf=Crazyflie()) as scf:
        rows, gate = [], threading.Event()
        config = LogConfig("slow", 10)
        config.add_variable("stateEstimate.z")
        scf.cf.log.add_config(config)

        def slow(stamp, data, _):
            gate.wait(0.002)
            rows.append(stamp)

        config.data_received_cb.add_callback(slow)
        with clock.hold():
            config.start()
        for step in range(1, 11):
            clock.sleep_until(0.1 * step)
        clock.sleep_until(1.02)
        assert rows == [10010 + 10 * i for i in range(len(rows))]
        assert len(rows) >= 100


def test_settling_gives_up_on_a_client_that_hangs(uri, swarm):
    with SyncCrazyflie(uri, cf=Crazyflie()) as scf:
        release = threading.Event()
        scf.cf.add_port_callback(8, lambda _: release.wait(5.0))
        scf.cf.high_level_commander.stop()
        assert not swarm.settle(0.05)
        release.set()
        assert swarm.settle(5.0)


def test_settling_costs_nothing_when_all_is_quiet(uri, swarm):
    with SyncCrazyflie(uri, cf=Crazyflie()) as scf:
        scf.cf.link_statistics.stop()
        assert swarm.settle(1.0)
        began = time.perf_counter()
        for _ in range(5000):
            swarm.settle(1.0)
        assert (time.perf_counter() - began) / 5000 < 20e-6


def test_closing_is_quick_and_counts_nothing_twice(uri, swarm):
    scf = SyncCrazyflie(uri, cf=Crazyflie())
    scf.open_link()
    driver = scf.cf.link
    scf.cf.link_statistics.stop()  # joins cflib's ping thread, which sleeps in between
    began = time.perf_counter()
    scf.close_link()
    assert time.perf_counter() - began < 0.5
    driver.close()
    driver._deliver(0, 0, b"too late")
    assert swarm.settle(0.0)


def test_packets_of_a_tick_arrive_at_its_end_in_their_order():
    traffic, inbox = Traffic(), queue.SimpleQueue()
    with traffic.hold(), traffic.lock:
        for number in range(3):
            traffic.add(inbox, CRTPPacket(0, bytes([number + 1])))
        assert inbox.empty()
    assert [inbox.get_nowait().data[0] for _ in range(3)] == [1, 2, 3]
    assert not traffic.settle(0.0)
    with traffic.lock:
        traffic.done(3)
    assert traffic.settle(0.0)


def test_threads_take_longer_turns_only_while_swarms_fly_in_virtual_time():
    before = sys.getswitchinterval()
    first, second = (
        SimulatedSwarm(["cf"], IdealWorld([(0.0, 0.0, 0.0)]), VirtualClock(), label=label) for label in ("one", "two")
    )
    first.close()
    assert sys.getswitchinterval() > 2 * before
    second.close()
    second.close()
    assert sys.getswitchinterval() == before
    unregister()


def test_a_drone_takes_one_client_at_a_time_and_another_after_it(uri):
    with SyncCrazyflie(uri, cf=Crazyflie()), pytest.raises(LinkError, match="already has a client"):
        SimulatedDriver().connect(uri, None, None)
    with SyncCrazyflie(uri, cf=Crazyflie()) as scf:
        assert scf.cf.is_connected()


def test_addresses_that_lead_nowhere(swarm):
    with pytest.raises(WrongUriType):
        SimulatedDriver().connect("radio://0/80/2M", None, None)
    with pytest.raises(LinkError, match=r"no drone 'cf9'.*'cf1', 'cf2'"):
        SimulatedDriver().connect("sim://test/cf9", None, None)
    with pytest.raises(LinkError, match=r"no simulated swarm 'other'.*test"):
        SimulatedDriver().connect("sim://other/cf1", None, None)
    with pytest.raises(LinkError, match="already on the air"):
        SimulatedSwarm(["a"], IdealWorld([(0.0, 0.0, 0.0)]), label="test")


def test_scanning_and_registering(swarm):
    register()
    register()
    assert cflib.crtp.CLASSES.count(SimulatedDriver) == 1
    assert SimulatedDriver().scan_interface() == [["sim://test/cf1", ""], ["sim://test/cf2", ""]]
    unregister()
    unregister()
    assert SimulatedDriver not in cflib.crtp.CLASSES


def test_statistics_reach_cflib_ten_times_a_second(uri, clock):
    with SyncCrazyflie(uri, cf=Crazyflie()) as scf:
        rates, quality = [], []
        scf.cf.link_statistics.uplink_rate_updated.add_callback(rates.append)
        scf.cf.link_statistics.link_quality_updated.add_callback(quality.append)
        clock.sleep_until(1.005)
        assert 9 <= len(rates) <= 11
        assert set(quality) == {100.0}


def test_a_reboot_ends_in_a_lost_connection(uri, clock, swarm):
    lost = []
    cf = Crazyflie()
    cf.connection_lost.add_callback(lambda _, reason: lost.append(reason))
    with SyncCrazyflie(uri, cf=cf):
        swarm.drones["cf1"].receive(0x41, b"\x09" + bytes(4) + b"\x04")  # reads a memory that does not exist
        clock.sleep_until(2.0)
        assert lost == ["Too many packets lost"]
    with SyncCrazyflie(uri, cf=Crazyflie()) as scf:
        assert scf.cf.is_connected()


def test_a_swarm_flies_a_trajectory_through_cflib(swarm, clock, tmp_path):
    """Upload, take-off, start together, land: the whole path of a flight, in virtual time."""
    circle = recording("poly4d")["trajectories"][0]
    image = bytes.fromhex(circle["image_hex"])
    duration = next(e["total"] for e in circle["evals"] if e["timescale"] == 1)
    factory = CachedCfFactory(rw_cache=str(tmp_path))
    with Swarm(set(swarm.uris().values()), factory=factory) as fleet:

        def upload(scf):
            memory = scf.cf.mem.get_mems(0x12)[0]
            done = threading.Event()
            scf.cf.mem.mem_write_cb.add_callback(lambda *_: done.set())
            scf.cf.mem.write(memory, 0, bytearray(image))
            assert done.wait(10.0)
            scf.cf.commander.send_notify_setpoint_stop()
            scf.cf.high_level_commander.define_trajectory(1, 0, circle["n_pieces"])
            scf.cf.high_level_commander.takeoff(1.0, 1.5)

        fleet.parallel_safe(upload)
        clock.sleep_until(2.0)
        fleet.parallel_safe(lambda scf: scf.cf.high_level_commander.start_trajectory(1, relative_position=True))
        clock.sleep_until(2.0 + duration / 2)
        halfway = [body.position for body in swarm._world.bodies]
        assert halfway[1][0] - halfway[0][0] == pytest.approx(1.0, abs=1e-5)
        assert halfway[0][:2] != pytest.approx((0.0, 0.0), abs=0.1)
        clock.sleep_until(2.0 + duration + 0.1)
        fleet.parallel_safe(lambda scf: scf.cf.high_level_commander.land(0.0, 1.5))
        clock.sleep_until(clock.now() + 4.0)
        assert [drone.info for drone in swarm.drones.values()] == [0x020E, 0x020E]
