"""The firmware model's ports beyond the recordings: storage, localisation, estimator reset, console, fuzzing."""

import math
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deploy.radio.simulated.crazyflie import BOOT_TIME, SimulatedCrazyflie
from deploy.radio.simulated.interface import Setpoint, SetpointMode, Telemetry
from deploy.radio.simulated.ports.log import encode
from deploy.radio.simulated.quaternion import compress, decompress, euler, to_body
from deploy.radio.simulated.toc import EXTENDED, READ_ONLY, log_toc, param_toc
from tests.deploy.ideal_world import TICK
from tests.deploy.simulated_bench import Bench

VLAND = param_toc(False).index["hlCommander.vland"]
TIMEOUT = param_toc(False).index["supervisor.landedTimeout"]  # persistent, u16, 3000
MISC = 3


@pytest.fixture
def bench():
    return Bench()


def identified(index):
    return struct.pack("<H", index)


def log_block(bench, names, period=1):
    """Start block 1 with float or u16 variables; None if refused."""
    toc = log_toc(False)
    entries = [(toc.entries[toc.index[name]].type, toc.index[name]) for name in names]
    bench.send(5, 1, b"\x06\x01" + b"".join(struct.pack("<BH", kind << 4 | kind, i) for kind, i in entries))
    bench.send(5, 1, bytes([3, 1, period]))
    return struct.Struct("<" + "".join({7: "f", 2: "H", 1: "B", 5: "h", 3: "I"}[kind] for kind, _ in entries))


def latest(bench, layout):
    data = [d for p, c, d in bench.received if (p, c) == (5, 2)]
    return layout.unpack(data[-1][4:])


def test_stored_parameters_survive_a_reboot(bench):
    bench.ask(2, 2, identified(TIMEOUT) + struct.pack("<H", 1234))
    assert bench.ask(2, MISC, b"\x04" + identified(TIMEOUT)) == [b"\x04" + identified(TIMEOUT) + b"\0\xb8\x0b"]
    assert bench.ask(2, MISC, b"\x03" + identified(TIMEOUT)) == [b"\x03" + identified(TIMEOUT) + b"\0"]
    assert bench.ask(2, MISC, b"\x04" + identified(TIMEOUT)) == [b"\x04" + identified(TIMEOUT) + b"\1\xb8\x0b\xd2\x04"]
    bench.ask(2, 2, identified(VLAND) + struct.pack("<f", 0.125))
    bench.send(4, 1, b"\x09" + bytes(4) + b"\x04")  # an assertion
    bench.advance(BOOT_TIME + TICK)
    assert bench.ask(2, 1, identified(TIMEOUT)) == [identified(TIMEOUT) + b"\0\xd2\x04"]
    assert bench.ask(2, 1, identified(VLAND)) == [identified(VLAND) + b"\0" + struct.pack("<f", 0.5)]
    bench.ask(2, MISC, b"\x05" + identified(TIMEOUT))
    assert bench.ask(2, MISC, b"\x04" + identified(TIMEOUT)) == [b"\x04" + identified(TIMEOUT) + b"\0\xb8\x0b"]


def test_what_cannot_be_stored_says_so(bench):
    assert bench.ask(2, MISC, b"\x03" + identified(VLAND)) == [b"\x03" + identified(VLAND) + b"\x02"]
    assert bench.ask(2, MISC, b"\x03" + identified(9999)) == [b"\x03" + identified(9999) + b"\x02"]


def test_default_values(bench):
    bench.ask(2, 2, identified(VLAND) + struct.pack("<f", 0.125))
    assert bench.ask(2, MISC, b"\x08" + identified(VLAND)) == [
        b"\x08" + identified(VLAND) + b"\0" + struct.pack("<f", 0.5)
    ]
    assert bench.ask(2, MISC, b"\x08" + identified(2)) == [b"\x08" + identified(2) + b"\x02"]  # read-only


def test_estimator_reset_reaches_the_world_once_and_is_announced(bench):
    index = param_toc(False).index
    bench.ask(2, 2, identified(index["kalman.initialX"]) + struct.pack("<f", 1.5))
    bench.ask(2, 2, identified(index["kalman.initialYaw"]) + struct.pack("<f", 0.5))
    bench.ask(2, 2, identified(index["kalman.resetEstimation"]) + b"\1")
    bench.received.clear()
    bench.advance(TICK)
    assert bench.body.orders.reset_estimator
    assert bench.body.orders.initial_pose == ((1.5, 0.0, 0.0), 0.5)
    assert (2, MISC, b"\x01" + identified(index["kalman.resetEstimation"]) + b"\0") in bench.received
    bench.advance(TICK)
    assert not bench.body.orders.reset_estimator


def test_external_poses_reach_the_world_in_order_with_their_deviations(bench):
    index = param_toc(False).index["locSrv.extPosStdDev"]
    bench.ask(2, 2, identified(index) + struct.pack("<f", 0.5))
    bench.send(6, 0, struct.pack("<fff", 1.0, 2.0, 3.0))
    bench.send(6, 1, b"\x08" + struct.pack("<fffffff", 1.5, 2.0, 3.0, 0.0, 0.0, 0.6, 0.8))
    packed = compress((0.0, 0.0, 0.6, 0.8))
    theirs = struct.pack("<BhhhI", 8, 0, 0, 0, packed)
    bench.send(6, 1, b"\x09" + theirs + struct.pack("<BhhhI", 7, 1500, -20, 30, packed))  # the bench drone's id is 7
    bench.send(6, 2, struct.pack("<Bhhh", 7, 4, 5, 6) + struct.pack("<Bhhh", 9, 1, 1, 1))
    bench.advance(TICK)
    first, second, third, fourth = bench.body.orders.measurements
    assert (first.position, first.quaternion, first.std_position) == ((1.0, 2.0, 3.0), None, 0.5)
    assert second.position == (1.5, 2.0, 3.0)
    assert second.quaternion == pytest.approx((0.0, 0.0, 0.6, 0.8))
    assert third.position == (1.5, -0.02, 0.03)
    assert third.quaternion == pytest.approx((0.0, 0.0, 0.6, 0.8), abs=0.002)
    assert fourth.position == (0.004, 0.005, 0.006)
    bench.advance(TICK)
    assert bench.body.orders.measurements == ()


def test_controller_choice_reaches_the_world(bench):
    index = param_toc(False).index["stabilizer.controller"]
    for value, controller in ((2, 2), (0, 1), (1, 1)):
        bench.ask(2, 2, identified(index) + bytes([value]))
        bench.advance(TICK)
        assert bench.body.orders.controller == controller


def test_gains_reach_the_world_while_they_differ_and_stored_ones_after_a_reboot(bench):
    index = identified(param_toc(False).index["ctrlMel.kp_xy"])
    bench.advance(TICK)
    before = bench.body.orders.tuning
    bench.ask(2, 2, identified(VLAND) + struct.pack("<f", 0.125))  # steers nobody's controller
    bench.advance(TICK)
    assert bench.body.orders.tuning is before
    bench.ask(2, 2, index + struct.pack("<f", 0.5))
    bench.ask(2, MISC, b"\x03" + index)
    bench.advance(TICK)
    assert bench.body.orders.tuning == {"ctrlMel.kp_xy": 0.5}
    bench.send(4, 1, b"\x09" + bytes(4) + b"\x04")  # an assertion
    bench.advance(BOOT_TIME + 2 * TICK)
    assert bench.body.orders.tuning == {"ctrlMel.kp_xy": 0.5}
    bench.ask(2, 2, index + param_toc(False).entries[struct.unpack("<H", index)[0]].default)
    bench.advance(TICK)
    assert bench.body.orders.tuning == {}


FULL_STATE = struct.pack("<9hI3h", *range(1000, 10000, 1000), compress((0.0, 0.0, 0.6, 0.8)), 100, 200, 250)
FOUR = struct.pack("<ffff", 1, 2, 3, 90)
TURN = (0, 0, math.pi / 2)


@pytest.mark.parametrize(
    ("kind", "payload", "mode", "field", "value"),
    [
        (7, FOUR, SetpointMode.POSITION, "yaw", math.pi / 2),
        (8, FOUR, SetpointMode.VELOCITY, "omega", TURN),
        (1, FOUR, SetpointMode.VELOCITY, "omega", (0, 0, -math.pi / 2)),
        (10, struct.pack("<ffff", 1, 2, 90, 3), SetpointMode.HOVER, "position", (0, 0, 3)),
        (10, struct.pack("<ffff", 1, 2, 90, 3), SetpointMode.HOVER, "omega", TURN),
        (5, struct.pack("<ffff", 1, 2, 90, 3), SetpointMode.HOVER, "omega", (0, 0, -math.pi / 2)),
        (9, struct.pack("<ffff", 10, 20, 90, 3), SetpointMode.HEIGHT, "position", (0, 0, 3)),
        (9, struct.pack("<ffff", 10, 20, 90, 3), SetpointMode.HEIGHT, "attitude", (math.pi / 18, -math.pi / 9)),
        (9, struct.pack("<ffff", 10, 20, 90, 3), SetpointMode.HEIGHT, "omega", TURN),
        (2, struct.pack("<ffff", 10, 20, 90, 3), SetpointMode.HEIGHT, "omega", (0, 0, -math.pi / 2)),
        (4, struct.pack("<ffff", 10, 20, 90, 0.5), SetpointMode.CLIMB, "velocity", (0, 0, 0.5)),
        (4, struct.pack("<ffff", 10, 20, 90, 0.5), SetpointMode.CLIMB, "omega", TURN),
        (11, struct.pack("<fffH?", 10, 20, 90, 40000, False), SetpointMode.ATTITUDE, "thrust", 40000),
        (11, struct.pack("<fffH?", 90, -90, 90, 40000, True), SetpointMode.RATES, "omega", (math.pi / 2,) * 3),
        (3, struct.pack("<BHHHH", 0, 1250, 1750, 1500, 1600), SetpointMode.ATTITUDE, "attitude", (0.436, 0.436)),
        (3, struct.pack("<BHHHH", 0, 1250, 1750, 1500, 1600), SetpointMode.ATTITUDE, "thrust", 39321),
        (3, struct.pack("<BHHHHH", 1, 1750, 1500, 1250, 1600, 1000), SetpointMode.RATES, "omega", (-6.283, 0, 3.49)),
        (3, struct.pack("<BHHHHH", 1, 1750, 1500, 1250, 900, 2000), SetpointMode.ATTITUDE, "thrust", 0),
        (6, FULL_STATE, SetpointMode.FULL, "acceleration", (7, 8, 9)),
        (6, FULL_STATE, SetpointMode.FULL, "omega", (0.1, 0.2, 0.25)),
        (0, b"", SetpointMode.OFF, "thrust", 0),
    ],
)
def test_setpoint_types(bench, kind, payload, mode, field, value):
    bench.send(7, 0, bytes([kind]) + payload)
    bench.advance(TICK)
    setpoint = bench.body.orders.setpoint
    assert setpoint.mode is mode
    assert getattr(setpoint, field) == pytest.approx(value, abs=1e-2 if kind == 3 else 1e-3)


@pytest.mark.parametrize(
    ("flight_modes", "mode", "field", "value"),
    [
        ({}, SetpointMode.ATTITUDE, "attitude", (math.pi / 6, -math.pi / 18)),
        ({}, SetpointMode.ATTITUDE, "omega", (0, 0, -math.pi / 2)),
        ({"yawMode": 1}, SetpointMode.ATTITUDE, "attitude", (0.2468, -0.4936)),  # (30 ∓ 10)°/√2
        ({"althold": 1}, SetpointMode.CLIMB, "velocity", (0, 0, 0.5)),
        ({"althold": 1}, SetpointMode.CLIMB, "attitude", (math.pi / 6, -math.pi / 18)),
        ({"althold": 1, "poshold": 1}, SetpointMode.VELOCITY, "velocity", (1 / 3, 1, 0.5)),
        ({"poshold": 1}, SetpointMode.ATTITUDE, "attitude", (0, 0)),
        ({"posSet": 1}, SetpointMode.POSITION, "position", (-10, 30, 49.151)),
        (
            {"stabModeRoll": 0, "stabModePitch": 0},
            SetpointMode.RATES,
            "omega",
            (math.pi / 6, -math.pi / 18, -math.pi / 2),
        ),
    ],
)
def test_flight_modes_say_what_the_four_numbers_on_port_3_mean(bench, flight_modes, mode, field, value):
    index = param_toc(False).index
    for name, setting in flight_modes.items():
        bench.ask(2, 2, identified(index[f"flightmode.{name}"]) + bytes([setting]))
    for thrust in (0, 49151):  # a zero one unlocks
        bench.send(3, 0, struct.pack("<fffH", 30, 10, 90, thrust))
    bench.advance(TICK)
    setpoint = bench.body.orders.setpoint
    assert setpoint.mode is mode
    assert getattr(setpoint, field) == pytest.approx(value, abs=1e-3)


def test_carefree_mode_is_an_assertion_of_the_firmware(bench):
    bench.ask(2, 2, identified(param_toc(False).index["flightmode.yawMode"]) + b"\0")
    bench.send(3, 0, bytes(14))
    assert bench.drone.reboots == 1


@pytest.mark.parametrize(
    ("payload", "kept"),
    [
        (b"\x07" + struct.pack("<ffff", 1, 2, 0.5, 90), Setpoint(SetpointMode.HEIGHT, (0.0, 0.0, 0.5))),
        (b"\x0a" + struct.pack("<ffff", 1, 2, 90, 0.5), Setpoint(SetpointMode.HEIGHT, (0.0, 0.0, 0.5))),
        (b"\x08" + struct.pack("<ffff", 1, 2, 0.5, 90), Setpoint(SetpointMode.CLIMB, velocity=(0.0, 0.0, 0.5))),
        (b"\x0b" + struct.pack("<fffH?", 9, 9, 9, 36000, False), Setpoint(SetpointMode.ATTITUDE, thrust=36000)),
        (b"\x0b" + struct.pack("<fffH?", 9, 9, 9, 36000, True), Setpoint(SetpointMode.ATTITUDE, thrust=36000)),
    ],
)
def test_half_a_second_without_a_setpoint_levels_the_drone_and_keeps_z(bench, payload, kept):
    bench.send(7, 0, payload)
    bench.advance(0.6)
    assert bench.body.orders.setpoint == kept
    bench.advance(2.0)
    assert not bench.body.orders.motors_allowed


@pytest.mark.parametrize(
    "packet", [b"\x07" + bytes(15), b"\x0b" + bytes(16), b"\x03" + bytes(8), b"\x03\x02" + bytes(8)]
)
def test_a_setpoint_of_the_wrong_length_is_an_assertion(bench, packet):
    bench.send(7, 0, packet)
    assert bench.drone.reboots == 1
    assert not bench.drone.is_alive


def test_log_values_live(bench):
    names = ["stateEstimate.x", "stateEstimate.yaw", "ctrltarget.z", "motor.m1", "supervisor.info", "stateEstimateZ.z"]
    bench.body.position, bench.body.yaw = (1.25, 0.0, 0.0), 0.5
    bench.advance(TICK)
    layout = log_block(bench, names)
    bench.send(8, 0, b"\x07" + struct.pack("<Bff?f", 0, 1.0, 0.0, True, 1.0))
    bench.advance(1.5)
    x, yaw, z, motor, info, z_mm = latest(bench, layout)
    assert (x, yaw) == pytest.approx((1.25, math.degrees(0.5)), abs=1e-4)
    assert z == pytest.approx(1.0, abs=1e-4)
    assert (motor, info, z_mm) == (36000, 0x031E, 1000)


def test_log_blocks_die_a_second_after_the_client(bench):
    log_block(bench, ["stateEstimate.x"])
    bench.drone.attach(None)
    bench.advance(0.5)
    bench.drone.attach(lambda port, channel, data: bench.received.append((port, channel, data)))
    bench.received.clear()
    bench.advance(0.1)
    assert any(p == 5 for p, _, _ in bench.received)
    bench.drone.attach(None)
    bench.advance(1.2)
    bench.drone.attach(lambda port, channel, data: bench.received.append((port, channel, data)))
    assert bench.ask(5, 1, b"\x04\x01") == [b"\x04\x01\x02"]


def test_timestamps_wrap_at_24_bits():
    bench = Bench(uptime=2**24 / 1000.0 - 0.05)
    log_block(bench, ["stateEstimate.x"])
    bench.advance(0.1)
    stamps = [int.from_bytes(d[1:4], "little") for p, c, d in bench.received if (p, c) == (5, 2)]
    assert stamps == [2**24 - 40, 2**24 - 30, 2**24 - 20, 2**24 - 10, 0, 10, 20, 30, 40, 50]


def test_console_says_why_it_locked(bench):
    bench.send(9, 1, b"\x03")
    bench.advance(0.2)
    text = b"".join(data for port, _, data in bench.received if port == 0)
    assert text == b"SUP: Locked, reboot required\n"


def battery_log(bench, name):
    """Start logging one pm variable twice a second; a function gives its latest value."""
    toc = log_toc(True)
    bench.send(5, 1, b"\x06\x01" + struct.pack("<BH", 0x44, toc.index[name]))
    bench.send(5, 1, b"\x03\x01\x32")
    return lambda: [d[4] for p, c, d in bench.received if (p, c) == (5, 2)][-1]


def test_battery_state_needs_five_seconds_and_a_low_battery_still_flies():
    bench = Bench(hardware=True)
    state = battery_log(bench, "pm.state")
    bench.send(8, 0, b"\x07" + struct.pack("<Bff?f", 0, 1.0, 0.0, True, 1.0))
    bench.body.voltage = 3.1
    bench.advance(4.0)
    assert state() == 0
    bench.advance(2.0)
    assert state() == 3  # a light and a sound; nothing lands by itself
    assert bench.body.position[2] == pytest.approx(1.0, abs=1e-4)
    bench.body.voltage = 3.3
    bench.advance(0.6)
    assert state() == 0


def test_the_threshold_of_a_low_battery_is_a_parameter():
    bench = Bench(hardware=True)
    state = battery_log(bench, "pm.state")
    bench.ask(2, 2, identified(param_toc(True).index["pm.lowVoltage"]) + struct.pack("<f", 3.9))
    bench.body.voltage = 3.8
    bench.advance(6.0)
    assert state() == 3


@pytest.mark.parametrize(("voltage", "level"), [(2.9, 0), (3.5, 10), (3.9, 50), (4.05, 90), (4.2, 90)])
def test_battery_level_is_the_firmwares_guess_from_the_voltage(voltage, level):
    bench = Bench(hardware=True)
    bench.body.voltage = voltage
    latest_level = battery_log(bench, "pm.batteryLevel")
    bench.advance(0.6)
    assert latest_level() == level


def test_below_the_brown_out_voltage_everything_stops_until_there_is_enough_again():
    bench = Bench()
    bench.send(8, 0, b"\x07" + struct.pack("<Bff?f", 0, 1.0, 0.0, True, 1.0))
    bench.advance(1.5)
    bench.body.voltage = 2.4
    bench.advance(5.0)
    assert (bench.drone.reboots, bench.drone.is_alive, bench.body.running) == (1, False, False)
    bench.body.voltage = 3.6
    bench.advance(BOOT_TIME + TICK)
    assert bench.ask(15, 0, b"abc") == [b"abc"]
    bench.advance(3.0)
    assert bench.info() == 0x020E
    assert not bench.body.running


def test_flight_is_refused_before_the_drone_knows_where_it_is():
    drone, answers = SimulatedCrazyflie("cf"), []
    drone.attach(lambda port, channel, data: answers.append(data))
    takeoff = b"\x07" + struct.pack("<Bff?f", 0, 1.0, 0.0, True, 1.0)
    drone.receive(0x80, takeoff)
    drone.tick(0.01, Telemetry(position=(3.0, 2.0, 0.0)))
    drone.receive(0x80, takeoff)
    assert [answer[3] for answer in answers] == [16, 0]
    assert drone.tick(0.02, Telemetry()).setpoint.position[:2] == (3.0, 2.0)


def test_tables_of_contents_are_sound():
    for toc in (log_toc(True), param_toc(True)):
        assert len(toc.index) == len(toc.entries)
        for entry in toc.entries:
            assert len(entry.group) + len(entry.name) + 2 <= 26
    for entry in param_toc(True).entries:
        assert entry.default
        assert not (entry.type & EXTENDED and entry.type & READ_ONLY)
    assert len({log_toc(h).crc for h in (True, False)} | {param_toc(h).crc for h in (True, False)}) == 4


@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: math.hypot(*q) > 0.1))
def test_quaternion_compression_round_trip(q):
    q = [v / math.hypot(*q) for v in q]
    back = decompress(compress(tuple(q)))
    assert abs(sum(a * b for a, b in zip(q, back, strict=True))) > 1 - 1e-5
    x, y, z = to_body(back, (0.3, -0.2, 0.9))
    assert math.hypot(x, y, z) == pytest.approx(math.hypot(0.3, -0.2, 0.9))


def test_euler_angles_of_single_rotations():
    for axis in range(3):
        q = [0.0, 0.0, 0.0, math.cos(0.2)]
        q[axis] = math.sin(0.2)
        assert euler(tuple(q)) == pytest.approx([0.4 if i == axis else 0.0 for i in range(3)])


@pytest.mark.parametrize(
    ("kind", "value", "wire"),
    [
        (1, 300.7, b"\x2c"),
        (5, -2.9, b"\xfe\xff"),
        (8, 1e6, b"\x00\x7c"),
        (7, 1e39, b"\x00\x00\x80\x7f"),
        (2, math.nan, b"\0\0"),
        (0, 1.0, b""),
    ],
)
def test_log_encoding_casts_like_c(kind, value, wire):
    assert encode(kind, value) == wire


packets = st.tuples(st.integers(0, 255), st.binary(max_size=30))
commands = st.tuples(
    st.sampled_from([0x80]), st.builds(lambda c, rest: bytes([c]) + rest, st.integers(0, 14), st.binary(max_size=24))
)


@settings(max_examples=60, deadline=None)
@given(st.lists(packets | commands, max_size=40))
def test_no_packet_crashes_the_model(sequence):
    bench = Bench()
    for header, data in sequence:
        bench.drone.receive(header, data)
        bench.advance(TICK)
        assert all(len(d) <= 30 for _, _, d in bench.received), bench.received[-1]
        bench.received.clear()
    bench.advance(BOOT_TIME + 0.1)
    assert bench.ask(15, 0, b"ping") == [b"ping"]


@settings(max_examples=60, deadline=None)
@given(
    image=st.binary(min_size=8, max_size=300),
    compressed=st.booleans(),
    pieces=st.integers(0, 255),
    timescale=st.floats(width=32),
    flags=st.tuples(st.booleans(), st.booleans(), st.booleans()),
    rewrite=st.binary(max_size=24),
)
def test_garbage_in_the_trajectory_memory_is_flown_without_a_fault(
    image, compressed, pieces, timescale, flags, rewrite
):
    """The firmware validates nothing; the model must survive what it then computes, and order nothing infinite."""
    bench = Bench()
    for address in range(0, len(image), 24):
        bench.send(4, 2, b"\0" + address.to_bytes(4, "little") + image[address : address + 24])
    bench.send(8, 0, struct.pack("<BBBBIB", 6, 1, 1, compressed, 0, pieces))
    bench.send(8, 0, struct.pack("<BB???Bf", 0x0D, 0, *flags, 1, 1.0 if compressed else timescale))
    for step in range(30):
        if step == 15:
            bench.send(4, 2, bytes(5) + rewrite)
            bench.send(8, 0, b"\x03\0")
        bench.advance(TICK)
        assert bench.body.orders.setpoint.is_finite()
    assert bench.drone.reboots == 0
