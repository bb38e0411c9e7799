"""Every recorded request and answer of real firmware, scenario by scenario."""

import json
from pathlib import Path

import pytest

from deploy.radio.simulated.crazyflie import BOOT_TIME
from tests.deploy.simulated_bench import Bench
from tests.recordings import recording

GOLDEN = Path(__file__).parents[1] / "golden"
CASES = [json.loads(line) for line in (GOLDEN / "protocol_cases.jsonl").read_text().splitlines()]
SCENARIOS = list(dict.fromkeys(case["scenario"] for case in CASES))
# Where the recorder's first packet fell between two steps of the supervisor is not known: chosen to fit.
PHASE = {"ground": 0.01}
# A window of 0.1 s, 5 s after a landing, which the recorded firmware (slower than real time) reached later [s].
EARLIER = {259: 0.4}
# The recorder also streamed this setpoint, unlisted, every 60 ms before these cases (supervisor_timeline.json has it).
STREAMED = {288: 9, 290: 4}
POSITION_SETPOINT = bytes.fromhex("070000000000000000cdcc4c3f00000000")
LOG_DATA = (5, 2)


def packet(text):
    place, _, payload = text.partition(" ")
    port, channel = place.split(":")
    return int(port), int(channel), bytes.fromhex(payload)


def run(bench, case):
    """Answers of one case on its port, the recorder's wait included."""
    bench.received.clear()
    port, channel, data = packet(case["request"])
    bench.send(port, channel, data)
    bench.advance(case["waited_ms"] // 10 / 100)
    return [p for p in bench.received if p[0] == port]


def upload_circle(bench):
    """The recorder's unlisted upload before the flight: eight pieces that last longer than the cases need."""
    trajectories = recording("poly4d")["trajectories"]
    image = bytes.fromhex(next(t["image_hex"] for t in trajectories if t["name"] == "circle 8 pieces"))
    for address in range(0, len(image), 24):
        bench.send(4, 2, b"\0" + address.to_bytes(4, "little") + image[address : address + 24])


def compare(case, got):
    want = [packet(answer) for answer in case["answers"]]
    requested = packet(case["request"])
    if requested[0] == 8 and len(requested[2]) < 3:  # byte 2 is what happened to be in the firmware's buffer
        want, got = ([(p, c, d[:2] + d[3:]) for p, c, d in side] for side in (want, got))
    controls = [p for p in got if p[:2] != LOG_DATA]
    assert controls == [p for p in want if p[:2] != LOG_DATA], case["note"]
    samples, recorded = ([p for p in side if p[:2] == LOG_DATA] for side in (got, want))
    assert len(samples) == pytest.approx(len(recorded), abs=1), case["note"]  # real time ran at 0.7 to 0.95
    for (_, _, mine), (_, _, theirs) in zip(samples, recorded, strict=False):
        assert (mine[0], len(mine)) == (theirs[0], len(theirs)), case["note"]
    stamps = [int.from_bytes(data[1:4], "little") for _, _, data in recorded]
    mine = [int.from_bytes(data[1:4], "little") for _, _, data in samples]
    if len(stamps) > 1 and len(mine) > 1:
        assert mine[1] - mine[0] == stamps[1] - stamps[0], case["note"]


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_recorded_answers(scenario):
    bench = Bench(phase=PHASE.get(scenario, 0.0))
    if scenario == "flight":
        upload_circle(bench)
    origin = bench.t
    for case in (case for case in CASES if case["scenario"] == scenario):
        due = origin + case["t_ms"] // 10 / 100 - EARLIER.get(case["n"], 0.0)
        bench.advance(max(0.0, due - bench.t))
        for _ in range(STREAMED.get(case["n"], 0)):
            bench.send(7, 0, POSITION_SETPOINT)
            bench.advance(0.06)
        before = case["supervisor_before"]
        if before is not None and "crash" not in scenario:
            assert bench.wait_for_info(int(before, 16), 0.9), (case["n"], case["note"], before, hex(bench.drone.info))
        got = run(bench, case)
        # After an assertion the recorded build stays silent for good; hardware, and the model, reboot.
        silent_in_both = scenario.startswith("crash") and bench.t - origin < BOOT_TIME
        if "build_specific" not in case or silent_in_both:
            compare(case, got)


@pytest.mark.parametrize("scenario", [s for s in SCENARIOS if s.startswith("crash")])
def test_an_assertion_reboots_the_drone(scenario):
    bench = Bench()
    for case in (case for case in CASES if case["scenario"] == scenario):
        run(bench, case)
    assert bench.drone.reboots == 1
    bench.advance(4.0)
    assert bench.ask(15, 0, b"abc") == [b"abc"]
    assert bench.info() == 0x020E
