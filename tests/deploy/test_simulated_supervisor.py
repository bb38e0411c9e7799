"""The supervisor's states and timings, against the recorded timeline and by the rules."""

import json
import struct
from pathlib import Path

import pytest

from deploy.radio.simulated.toc import param_toc
from tests.deploy.ideal_world import TICK
from tests.deploy.simulated_bench import Bench
from tests.deploy.test_simulated_protocol import upload_circle

GOLDEN = Path(__file__).parents[1] / "golden"
SCENARIOS = json.loads((GOLDEN / "supervisor_timeline.json").read_text())["scenarios"]
TAKEOFF = bytes.fromhex("07000000003f00000000000000803f")  # 0.5 m in 1 s
READY, HOVERING, LOCKED = 0x020E, 0x031E, 0x0244
BECAME_READY = 1.34  # [s] after boot, before the recorder's first poll: its pre-flight timeout came 30 s after that
PHASE = {
    "ground": 0.02,
    "air": 0.02,
}  # of the supervisor's 40 ms steps against the recorder's packets, chosen to fit [s]
NOTIFY_STOP = b"\0" * 5


def replay(events, phase):
    """(time, bit field) of every change when the recorded packets are sent at their recorded times [s]."""
    start = BECAME_READY + phase
    bench = Bench(uptime=start)
    upload_circle(bench)
    bench.advance(events[0]["t_ms"] / 1000.0 - start)
    changes = [(start + bench.t, bench.drone.info)]
    pending = [(e["t_ms"] / 1000.0, e["sent"]) for e in events if "sent" in e]
    while start + bench.t < events[-1]["t_ms"] / 1000.0 + 0.1:
        while pending and pending[0][0] <= start + bench.t:
            _, sent = pending.pop(0)
            bench.send(sent["port"], sent["channel"], bytes.fromhex(sent["hex"]))
        bench.advance(TICK)
        if bench.drone.info != changes[-1][1]:
            changes.append((start + bench.t, bench.drone.info))
    return changes


def lasting(changes):
    """Without bit fields of one or two supervisor steps (40 ms): whether the recorder's poll saw those is chance."""
    ends = [t for t, _ in changes[1:]] + [float("inf")]
    kept = [(t, info) for (t, info), end in zip(changes, ends, strict=True) if end - t > 0.1]
    return [change for i, change in enumerate(kept) if i == 0 or change[1] != kept[i - 1][1]]


@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda s: s["scenario"])
def test_recorded_timeline(scenario):
    want = lasting([(e["t_ms"] / 1000.0, int(e["info"], 16)) for e in scenario["events"] if "info" in e])
    got = lasting(replay(scenario["events"], PHASE.get(scenario["scenario"], 0.0)))
    assert [hex(info) for _, info in got] == [hex(info) for _, info in want]
    for (mine, info), (theirs, _) in zip(got, want, strict=True):
        assert mine == pytest.approx(theirs, abs=0.09), hex(info)


def test_rearming_passes_through_the_recorded_states():
    bench = Bench()
    assert bench.wait_for_info(0x0204, 30.2)  # pre-flight timeout
    seen = []
    for _ in range(16):
        bench.advance(TICK)
        seen.append(bench.drone.info)
    assert list(dict.fromkeys(seen)) == [0x0204, 0x0207, 0x0206, READY]


def hover(bench):
    assert bench.ask(8, 0, TAKEOFF)[0][3] == 0
    bench.advance(1.2)
    assert bench.drone.info == HOVERING


def test_emergency_stop_by_parameter_locks_for_good():
    bench = Bench()
    hover(bench)
    bench.send(2, 2, bytes([20, 0, 1]))  # stabilizer.stop
    bench.advance(0.2)
    assert bench.drone.info == LOCKED
    bench.send(2, 2, bytes([20, 0, 0]))
    bench.advance(5.0)
    assert bench.drone.info == LOCKED
    assert not bench.body.orders.motors_allowed


def test_tumbling_in_flight_crashes_and_recovery_needs_the_right_way_up():
    bench = Bench()
    hover(bench)
    bench.body.tumbled = True
    bench.advance(0.2)
    assert bench.drone.info & 0x00A8 == 0x00A0  # tumbled, crashed, cannot fly
    assert bench.ask(9, 1, b"\x02") == [b"\x82\0\0"]
    bench.body.tumbled = False
    bench.advance(0.1)
    assert bench.ask(9, 1, b"\x02") == [b"\x82\1\1"]
    bench.advance(3.0)
    assert bench.drone.info == READY


@pytest.mark.parametrize(("allowed", "crashes"), [(0.0, False), (8.0, True), (12.0, False)])
def test_a_blow_in_flight_is_a_crash_if_the_parameter_says_so(allowed, crashes):
    bench = Bench()
    index = param_toc(False).index["supervisor.crashDetectGs"]
    bench.send(2, 2, struct.pack("<Hf", index, allowed))
    hover(bench)
    bench.body.accelerometer = (0.0, 6.0, 8.0)  # 10 g: 9 more than at rest
    bench.advance(TICK)
    bench.body.accelerometer = (0.0, 0.0, 1.0)
    bench.advance(0.1)
    assert bool(bench.drone.info & 0x80) is crashes
    assert bench.body.running is not crashes


def test_without_auto_arming_a_request_is_needed():
    bench = Bench(auto_arm=False)
    bench.advance(1.0)
    assert bench.drone.info == 0x0201  # can be armed
    assert bench.ask(8, 0, TAKEOFF)[0][3] == 16
    assert bench.ask(9, 1, b"\x01\x01") == [b"\x81\1\1"]
    bench.advance(0.2)
    assert bench.drone.info == 0x020A
    hover_answer = bench.ask(8, 0, TAKEOFF)[0][3]
    assert hover_answer == 0


def test_closing_the_link_drops_the_drone_and_the_next_take_off_needs_a_notify():
    bench = Bench()
    hover(bench)
    bench.send(3, 0, bytes(14))  # what cflib's close_link sends
    bench.advance(0.05)
    assert not bench.body.running
    bench.advance(10.0)
    assert bench.drone.info == LOCKED  # the setpoint in force is too old


def test_notify_gives_the_high_level_commander_back_its_turn():
    bench = Bench()
    bench.send(3, 0, bytes(14))
    assert bench.ask(8, 0, TAKEOFF)[0][3] == 0
    bench.advance(1.0)
    assert not bench.body.running  # answered, but overridden
    bench.send(7, 1, NOTIFY_STOP)
    bench.send(8, 0, b"\x03\0")
    hover(bench)
    assert bench.body.position[2] == pytest.approx(0.5, abs=1e-4)


def test_low_level_setpoints_need_a_zero_thrust_first():
    bench = Bench()
    climb = bytes(12) + (40000).to_bytes(2, "little")
    bench.send(3, 0, climb)
    bench.advance(TICK)
    assert not bench.body.running
    bench.send(3, 0, bytes(14))
    bench.send(3, 0, climb)
    bench.advance(TICK)
    assert bench.body.orders.setpoint.thrust == 40000
