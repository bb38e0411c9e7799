"""More than a hundred thousand packets that no client should send: nothing crashes, hangs, or spreads to others."""

import contextlib
import math
import socket
import struct

import cflib.crtp
import numpy as np
import pytest
from cflib.crtp.crtpstack import CRTPPacket
from hypothesis import given, settings
from hypothesis import strategies as st

from deploy.clock import VirtualClock
from deploy.radio.simulated.crazyflie import BOOT_TIME, SimulatedCrazyflie
from deploy.radio.simulated.driver import SimulatedDriver, unregister
from deploy.radio.simulated.physics.mixer import mix
from deploy.radio.simulated.physics.world import World
from deploy.radio.simulated.server import UdpServer
from deploy.radio.simulated.swarm import SimulatedSwarm
from deploy.radio.simulated.toc import param_toc
from missions.airframes import airframe
from tests.deploy.ideal_world import TICK
from tests.deploy.packet_storm import NASTY, Storm, recorded
from tests.deploy.simulated_bench import Bench
from tests.deploy.test_simulated_protocol import upload_circle

ROUNDS, PACKETS = 56, 2000
TAKEOFF = b"\x07" + struct.pack("<Bff?f", 0, 0.5, 0.0, True, 0.5)
HANDSHAKE = (
    (15, 1, b"\0"), (13, 1, b"\0"), (5, 1, b"\x05"), (5, 0, b"\x03"), (5, 0, b"\x02\x05\0"), (4, 0, b"\x01"),
    (4, 0, b"\x02\0"), (2, 0, b"\x03"), (2, 0, b"\x02\x07\0"), (2, 3, b"\x07\x10\0"), (15, 0, b"ping"),
)  # fmt: skip


def shake_hands(bench):
    """What a client asks first, and the answers."""
    return [bench.ask(*request) for request in HANDSHAKE]


EXPECTED = shake_hands(Bench())


def take_off(bench):
    """Into the air, and along a trajectory."""
    upload_circle(bench)
    bench.send(8, 0, b"\x06" + struct.pack("<BBBIB", 1, 1, 0, 0, 8))
    assert bench.ask(8, 0, TAKEOFF)[0][3] == 0
    bench.advance(0.6)
    assert bench.ask(8, 0, b"\x0d" + struct.pack("<B???Bf", 0, True, False, False, 1, 1.0))[0][3] == 0
    bench.advance(0.1)
    assert bench.body.running


def still_answers(bench):
    if not bench.drone.is_alive:
        bench.advance(BOOT_TIME + TICK)
    assert all(len(data) <= 30 for _, _, data in bench.received)
    assert shake_hands(bench) == EXPECTED


@pytest.mark.parametrize("batch", range(4))
def test_a_hundred_thousand_packets(batch):
    """On the ground and in flight by turns; who asserts reboots and goes on."""
    heard = 0
    for seed in range(batch, ROUNDS, 4):
        bench = Bench(hardware=False)
        if seed // 4 % 2:
            take_off(bench)
        for number, (header, data) in enumerate(Storm(seed).packets(PACKETS)):
            heard += bench.drone.is_alive
            bench.drone.receive(header, data)
            if not bench.drone.is_alive:
                bench.advance(BOOT_TIME + TICK)
            elif number % 8 == 0:
                bench.advance(TICK)
            if len(bench.received) > 500:
                assert all(len(answer) <= 30 for _, _, answer in bench.received)
                bench.received.clear()
        still_answers(bench)
    assert heard >= 100_000 / 4


nasty = st.one_of(st.sampled_from(NASTY), st.floats(width=32)).map(lambda value: struct.pack("<f", value))
floats = st.lists(nasty, max_size=6).map(b"".join)
anything = st.tuples(st.integers(0, 255), st.binary(max_size=30))
commands = st.tuples(
    st.just(0x80),
    st.builds(
        lambda command, flags, numbers: (bytes([command]) + flags + numbers)[:30],
        st.integers(0, 14),
        st.binary(max_size=4),
        floats,
    ),
)
poses = st.tuples(st.sampled_from([0x60, 0x61]), floats.map(lambda numbers: (b"\x08" + numbers)[:30]))
uploads = st.tuples(
    st.just(0x42), st.builds(lambda at, data: struct.pack("<BI", 0, at) + data, st.integers(0, 4096), floats)
)
damaged = st.builds(
    lambda packet, at, byte: (packet[0], packet[1][:at] + bytes([byte]) + packet[1][at + 1 :]),
    st.sampled_from(recorded()),
    st.integers(0, 29),
    st.integers(0, 255),
).map(lambda packet: (packet[0], packet[1][:30]))


@settings(max_examples=100)
@given(st.lists(anything | commands | poses | uploads | damaged, max_size=30), st.booleans())
def test_no_sequence_crashes_the_model(sequence, flying):
    bench = Bench()
    if flying:
        take_off(bench)
    for header, data in sequence:
        bench.drone.receive(header, data)
        bench.advance(TICK)
    still_answers(bench)


class TwoDrones:
    """Two drones of the simulated physics; one is told what it should not be told."""

    def __init__(self):
        positions = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
        self.world = World([airframe("cf21")] * 2, positions, np.zeros(2), seed=3)
        self.drones = [SimulatedCrazyflie(name) for name in ("victim", "witness")]
        self.answers = []
        self.drones[0].attach(lambda port, channel, data: self.answers.append((port, channel, data)))
        self.world.attach(self.drones)
        self.ticks, self.ticks_with_pose = 0, 200  # of the victim
        self.advance(50)
        for drone in self.drones:
            drone.receive(0x80, TAKEOFF)
        self.advance(150)
        assert self.world.positions[:, 2] == pytest.approx(0.5, abs=0.1)

    def advance(self, ticks):
        """Tick by tick, with exact poses; after a while the victim gets none."""
        for _ in range(ticks):
            poses = zip(self.drones, self.world.positions.tolist(), self.world.quaternions.tolist(), strict=True)
            for drone, position, quaternion in poses:
                if drone is self.drones[1] or self.ticks < self.ticks_with_pose:
                    drone.receive(0x61, b"\x08" + struct.pack("<7f", *position, *quaternion))
            self.ticks += 1
            self.world.advance(self.ticks * TICK)

    def check(self):
        """The world is sound, and the witness hovers."""
        assert np.isfinite(self.world.positions).all()
        assert np.isfinite(self.world.quaternions).all()
        assert np.isfinite(self.world.motors).all()
        assert self.world.positions[1] == pytest.approx((1.0, 0.0, 0.5), abs=0.1)


@pytest.mark.parametrize("seed", range(2))
def test_physics_of_one_drone_survives_and_others_do_not_notice(seed):
    pair = TwoDrones()
    for sent, (header, data) in enumerate(Storm(seed).packets(700)):
        pair.drones[0].receive(header, data)
        if sent % 4 == 0:
            pair.advance(1 if pair.drones[0].is_alive else round(BOOT_TIME / TICK))
        pair.answers.clear()
    pair.advance(round(BOOT_TIME / TICK) + 100)
    pair.drones[0].receive(0xF0, b"still there?")
    assert pair.answers[-1] == (15, 0, b"still there?")
    pair.check()


def test_poses_of_impossible_numbers_harm_one_estimator_until_its_reset():
    pair = TwoDrones()
    for value in (math.nan, math.inf, -math.inf, 3e38, -1e20):
        for field in range(7):
            pose = [0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0]
            pose[field] = value
            pair.drones[0].receive(0x61, b"\x08" + struct.pack("<7f", *pose))
            pair.advance(1)
            pair.check()
    pair.drones[0].receive(0x61, b"\x08" + bytes(28))  # no direction at all
    pair.advance(2)
    pair.check()
    assert np.isfinite(pair.drones[0]._snapshot.telemetry.position).all()


@pytest.mark.parametrize("controller", [1, 2])
def test_parameters_of_impossible_numbers_harm_one_drone(controller):
    """Gains, noise and deviations of the victim, one after the other, with poses that go on."""
    pair = TwoDrones()
    toc = param_toc(True)
    pair.drones[0].receive(0x22, struct.pack("<HB", toc.index["stabilizer.controller"], controller))
    pair.ticks_with_pose = math.inf
    steering = ("pid", "posCtl", "velCtl", "ctrlMel", "kalman", "locSrv", "quadSysId", "hlCommander")
    floats = [i for i, e in enumerate(toc.entries) if e.group.startswith(steering) and e.type & 0x4F == 0x06]
    assert len(floats) > 40
    for number, index in enumerate(floats):
        before = toc.entries[index].default
        pair.drones[0].receive(0x22, struct.pack("<Hf", index, NASTY[number % 3]))
        pair.advance(1)
        pair.drones[0].receive(0x22, struct.pack("<H", index) + before)
        pair.check()
    reset = toc.index["kalman.resetEstimation"]
    pair.drones[0].receive(0x22, struct.pack("<Hf", toc.index["kalman.initialYaw"], math.nan))
    pair.drones[0].receive(0x22, struct.pack("<HB", reset, 1))
    pair.advance(2)
    pair.check()
    assert np.isfinite(pair.drones[0]._snapshot.telemetry.quaternion).all()


def test_motor_commands_that_are_no_numbers_turn_no_motor():
    thrust = np.array([[40000.0], [math.nan], [40000.0], [70000.0]])
    moments = np.array([[100.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, math.inf, 0.0], [0.0, 0.0, 0.0]])
    with np.errstate(invalid="ignore"):
        command = mix(thrust, moments)
    assert command[0] == pytest.approx(mix(thrust[:1], moments[:1])[0])
    assert not command[1:3].any()
    assert (command[3] == 65535.0).all()


def test_the_driver_takes_whatever_comes():
    clock = VirtualClock(patience=10.0)
    world = World([airframe("cf21")], np.zeros((1, 3)), np.zeros(1))
    with SimulatedSwarm(["cf"], world, clock, label="storm") as swarm:
        driver = cflib.crtp.get_link_driver(swarm.uris()["cf"], None, None)
        assert isinstance(driver, SimulatedDriver)
        for number, (header, data) in enumerate(Storm(11).packets(3000)):
            driver.send_packet(CRTPPacket(header, data))
            if number % 10 == 0:
                drain(driver)
                clock.sleep_until(clock.now() + TICK)
        drain(driver)
        for _ in range(30):
            clock.sleep_until(clock.now() + 0.05)
            drain(driver)
        driver.send_packet(CRTPPacket(0xF0, b"still there?"))
        assert driver.receive_packet(1.0).data == bytearray(b"still there?")
        driver.close()
        assert clock.stalls == 0
    unregister()


def drain(driver):
    while driver.receive_packet(0) is not None:
        pass


def test_the_server_takes_whatever_comes():
    drone = SimulatedCrazyflie("cf")
    with UdpServer({"cf": drone}, port=0) as server, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        host, _, port = server.uris["cf"].removeprefix("udp://").rpartition(":")
        client.connect((host, int(port)))
        client.settimeout(0.0)
        for header, data in Storm(12).packets(2000):
            client.send(bytes([header]) + data)
            server.exchange(0.0, 1.0)
            with contextlib.suppress(BlockingIOError):
                while client.recv(100):
                    pass
        assert drone.reboots or drone.is_alive
