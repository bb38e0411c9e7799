"""The planner and both evaluators against recordings of the firmware's own code."""

from pathlib import Path

import numpy as np
import pytest

from deploy.radio.simulated.high_level.compressed import CompressedTrajectory
from deploy.radio.simulated.high_level.evaluation import Evaluation
from deploy.radio.simulated.high_level.planner import Planner
from deploy.radio.simulated.high_level.trajectory import PolynomialTrajectory, TrajectoryMemory
from tests.recordings import recording

GOLDEN = Path(__file__).parents[1] / "golden"
POLY4D = recording("poly4d")["trajectories"]
COMPRESSED = recording("compressed")["trajectories"]
SEQUENCES = recording("planner")["sequences"]
FIELDS = {"pos": "position", "vel": "velocity", "acc": "acceleration", "jerk": "jerk", "omega": "omega"}


def memory_with(image_hex):
    memory = TrajectoryMemory()
    memory.write(0, bytes.fromhex(image_hex))
    return memory


def close(got: Evaluation, want, name, tolerance, relative=False):
    value = got.yaw if name == "yaw" else getattr(got, FIELDS[name])
    want = np.asarray(want)
    scale = np.maximum(1.0, abs(want)) if relative else 1.0
    return bool(np.all(abs(np.asarray(value) - want) <= tolerance * scale)), (name, value, want)


@pytest.mark.parametrize("case", POLY4D, ids=lambda c: c["name"])
def test_poly4d_is_evaluated_as_by_the_firmware(case):
    tolerances = {"pos": 2e-5, "yaw": 5e-5, "vel": 5e-5, "acc": 2e-4, "jerk": 2e-3, "omega": 1e-4}
    memory = memory_with(case["image_hex"])
    for run in case["evals"]:
        trajectory = PolynomialTrajectory(
            memory, 0, len(case["pieces"]), np.float32(run["t_begin"]), np.float32(run["timescale"]), run["reversed"]
        )
        for i, (t, where) in enumerate(zip(run["t"], run["where"], strict=True)):
            got = trajectory.evaluate(np.float32(t))
            for name, tolerance in tolerances.items():
                ok, detail = close(got, run[name][i], name, tolerance)
                assert ok, (t, where, run["timescale"], run["reversed"], detail)


@pytest.mark.parametrize("case", COMPRESSED, ids=lambda c: c["name"])
def test_compressed_is_evaluated_as_by_the_firmware(case):
    tolerances = {"pos": 1e-5, "yaw": 1e-4, "vel": 1e-3, "acc": 2e-3, "jerk": 2e-3}
    trajectory = CompressedTrajectory(memory_with(case["image_hex"]), 0, np.float32(0.0))
    for samples in (case["samples"], case["rewind"]):
        for i, t in enumerate(samples["t"]):
            got = trajectory.evaluate(np.float32(t))
            inside = "where" not in samples or samples["where"][i] not in "je"
            for name, tolerance in tolerances.items():
                if name in samples and (inside or name in ("pos", "yaw")):
                    ok, detail = close(got, samples[name][i], name, tolerance, relative=name not in ("pos", "yaw"))
                    assert ok, (t, detail)


class Replay:
    """Feeds a recorded command sequence to the planner."""

    def __init__(self, sequence):
        self.planner = Planner()
        self.memories = [memory_with(t["image_hex"]) for t in sequence["trajectories"]]

    def command(self, command):
        t, args = np.float32(command["t"]), dict(command["args"])
        return getattr(self, command["op"])(t, args) or 0

    def takeoff(self, t, a):
        return self.planner.takeoff(t, a["curr_pos"], a["curr_yaw"], a["height"], a["yaw"], a["duration"])

    def land(self, t, a):
        return self.planner.land(t, a["curr_pos"], a["curr_yaw"], a["height"], a["yaw"], a["duration"])

    def origin(self, t, a):
        goal = self.planner.goal(t)
        if goal is not None:
            return goal
        return Evaluation(a["from"]["pos"], a["from"]["vel"], yaw=a["from"]["yaw"])

    def go_to(self, t, a):
        origin = self.origin(t, a)
        return self.planner.go_to(t, origin, a["pos"], a["yaw"], a["duration"], a["relative"], a["linear"])

    def spiral(self, t, a):
        return self.planner.spiral(
            t,
            self.origin(t, a),
            a["angle"],
            a["r0"],
            a["rf"],
            a["ascent"],
            a["duration"],
            a["sideways"],
            a["clockwise"],
        )

    def start_trajectory(self, t, a):
        memory = self.memories[a["trajectory"]]
        pieces = self.length(memory)
        trajectory = PolynomialTrajectory(memory, 0, pieces, t, np.float32(a["timescale"]), a["reversed"])
        if a["relative_position"]:
            trajectory.start_at(a["start_from"], a["start_yaw"] if a["relative_yaw"] else None)
        return self.planner.start(trajectory)

    def start_compressed(self, t, a):
        trajectory = CompressedTrajectory(self.memories[a["trajectory"]], 0, t)
        if a["relative_position"]:
            trajectory.start_at(a["start_from"])
        return self.planner.start(trajectory)

    def stop(self, t, a):
        self.planner.stop()

    def disable(self, t, a):
        self.planner.disable()

    def is_joint(self, t):
        """Whether a compressed trajectory changes segments, and velocity, within a millisecond of t."""
        if not isinstance(self.planner._trajectory, CompressedTrajectory):
            return False
        before, after = (self.planner.goal(np.float32(t + dt)) for dt in (-1e-3, 1e-3))
        return np.abs(np.subtract(before.velocity, after.velocity)).max() > 0.05

    @staticmethod
    def length(memory):
        return next(n for n in range(32) if not any(memory.read(132 * n, 132)))


@pytest.mark.parametrize("sequence", SEQUENCES, ids=lambda s: s["name"])
def test_planner_follows_the_recorded_sequence(sequence):
    tolerances = {"pos": 1e-4, "vel": 4e-4, "acc": 2e-3, "jerk": 1e-2, "yaw": 1e-4, "omega": 2e-3}
    replay, samples, commands = Replay(sequence), sequence["samples"], list(sequence["commands"])
    for i, t in enumerate(samples["t"]):
        while commands and commands[0]["t"] <= t:
            command = commands.pop(0)
            assert replay.command(command) == command["ret"], command
            assert replay.planner.state == command["state_after"], command
        goal = replay.planner.goal(np.float32(t))
        assert replay.planner.state == samples["state"][i], t
        assert replay.planner.is_finished(np.float32(t)) == samples["finished"][i], t
        assert (goal is not None) == bool(samples["valid"][i]), t
        for name, tolerance in tolerances.items() if goal else ():
            if name not in ("pos", "yaw") and replay.is_joint(t):
                continue  # float32 decides which of two segments answers there
            ok, detail = close(goal, samples[name][i], name, tolerance)
            assert ok, (t, detail)


def test_rewriting_the_memory_in_flight_changes_the_flight():
    case = next(c for c in POLY4D if c["name"] == "circle 8 pieces")
    memory = memory_with(case["image_hex"])
    trajectory = PolynomialTrajectory(memory, 0, 8, np.float32(0.0), np.float32(1.0))
    before = trajectory.evaluate(np.float32(0.1)).position
    memory.write(0, np.float32(before[0] + 3.0).tobytes())  # the constant term of x in the first piece
    after = trajectory.evaluate(np.float32(0.1)).position
    assert after[0] - before[0] > 1.0
    assert after[1:] == before[1:]


def curvy_pieces(count=3):
    rng = np.random.default_rng(3)
    pieces = rng.normal(scale=0.3, size=(count, 33)).astype("<f4")
    pieces[:, 32] = 0.31  # no multiple of a tick
    return pieces.tobytes()


def twins(*commands):
    """Two planners that are given the same trajectory in memories of their own."""
    for _ in range(2):
        memory, planner = TrajectoryMemory(), Planner()
        memory.write(0, curvy_pieces())
        for command in commands:
            command(planner, memory)
        yield planner, memory


@pytest.mark.parametrize("reverse", [False, True])
def test_looking_ahead_changes_no_goal(reverse):
    def start(planner, memory):
        planner.start(PolynomialTrajectory(memory, 0, 3, np.float32(10.0), np.float32(1.1), reverse))

    (ahead, _), (tick_by_tick, _) = twins(start)
    for k in range(150):
        now = 10.0 + 0.01 * k
        assert ahead.follow(now)[1] == tick_by_tick.goal(np.float32(now))


def test_what_was_foreseen_is_forgotten_when_memory_or_trajectory_change():
    def start(planner, memory):
        planner.start(PolynomialTrajectory(memory, 0, 3, np.float32(10.0), np.float32(1.0)))

    (ahead, one), (tick_by_tick, other) = twins(start)
    for k in range(20):
        ahead.follow(10.0 + 0.01 * k)
    for memory in (one, other):
        memory.write(0, curvy_pieces()[:64] + bytes(8))
    assert ahead.follow(10.2)[1] == tick_by_tick.goal(np.float32(10.2))
    for planner in (ahead, tick_by_tick):
        planner.land(np.float32(10.2), (0.0, 0.0, 1.0), 0.0, 0.0, 0.0, 0.1)
    for now in (10.21, 10.25, 10.31, 10.32):
        assert ahead.follow(now)[1] == tick_by_tick.goal(np.float32(now))
        assert ahead.state is tick_by_tick.state
