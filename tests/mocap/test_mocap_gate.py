"""What the gate believes of motion capture: nothing that cannot be, and everything that can."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mocap.gate import GAP, Gate
from mocap.source import MocapFrame, Pose
from mocap.track import Word

DT = 0.01
LEVEL = (0.0, 0.0, 0.0, 1.0)
NAMES = ("cf1", "cf2", "cf3")
BODIES = {name: f"body {name}" for name in NAMES}
SPOTS = {name: np.array([0.4 * k, 0.0, 1.0]) for k, name in enumerate(NAMES)}


class Room:
    """Robots that fly by, seen a hundred times a second with a millimetre of noise; their own words are right."""

    def __init__(self, seed=0, speed=0.5):
        self.rng, self.speed = np.random.default_rng(seed), speed
        self.words = {}
        self.gate = Gate(BODIES, self.words.get)
        self.k = 0
        self.incidents = []
        self.step()
        self.gate.close()
        for _ in range(20):
            self.step()

    @property
    def t(self):
        return self.k * DT

    def truth(self, name):
        return SPOTS[name] + [0.0, self.speed * self.t, 0.0]

    def poses(self):
        return {BODIES[name]: Pose(tuple(self.truth(name) + self.rng.normal(0.0, 0.001, 3)), LEVEL) for name in NAMES}

    def step(self, change=lambda bodies: bodies):
        self.k += 1
        for name in NAMES:
            self.words[name] = Word(
                self.t - 0.05, tuple(self.truth(name) - [0, self.speed * 0.05, 0]), (0, self.speed, 0), (0, 0, 0)
            )
        admitted = self.gate.admit(MocapFrame(self.t, self.k, change(self.poses())))
        self.incidents += admitted.incidents
        return admitted.poses

    def pass_unseen(self, seconds):
        for _ in range(round(seconds / DT)):
            self.step(lambda bodies: {})

    def right(self, poses):
        """Who is told the truth; nobody is told anything else."""
        for name, pose in poses.items():
            assert math.dist(pose.position, self.truth(name)) < 0.02, name
        return set(poses)

    @property
    def kinds(self):
        return [incident.kind for incident in self.incidents]


def named(order):
    """Bodies under each other's names."""
    return lambda bodies: dict(zip(bodies, [bodies[BODIES[name]] for name in order], strict=True))


def beside(name, offset):
    def change(bodies):
        pose = bodies[BODIES[name]]
        moved = tuple(p + o for p, o in zip(pose.position, offset, strict=True))
        return {**bodies, BODIES[name]: Pose(moved, pose.quaternion)}

    return change


def test_what_is_seen_is_believed():
    room = Room()
    assert all(room.right(room.step()) == set(NAMES) for _ in range(50))
    assert room.incidents == []


@pytest.mark.parametrize("order", list(itertools.permutations(NAMES))[1:])
def test_whatever_names_bodies_get_everybody_is_told_his_own_pose(order):
    room = Room()
    for _ in range(30):
        assert room.right(room.step(named(order))) == set(NAMES)
    (swap,) = room.incidents
    assert (swap.kind, set(swap.robots)) == ("swap", {a for a, b in zip(NAMES, order, strict=True) if a != b})
    assert all(room.right(room.step()) == set(NAMES) for _ in range(5))  # and back again
    assert room.kinds == ["swap", "swap"]


@settings(max_examples=60)
@given(st.integers(0, 2), st.tuples(*[st.floats(-3.0, 3.0)] * 3), st.integers(1, 60))
def test_a_pose_that_jumps_is_kept_from_its_drone_however_long_it_lasts(who, offset, frames):
    room, name = Room(), NAMES[who]
    assume(math.hypot(*offset) > 0.15)
    for _ in range(frames):
        assert room.right(room.step(beside(name, offset))) == set(NAMES) - {name}
    assert room.gate.refused == (name,)
    assert room.right(room.step()) == set(NAMES)
    assert room.gate.refused == ()
    first, again = room.incidents
    assert (first.kind, again.kind) == ("teleport", "again")
    assert first.value == pytest.approx(math.hypot(*offset), abs=0.02)
    assert f"{frames} poses" in again.text


def test_a_jump_of_everybody_is_told_in_one_word():
    room = Room()

    def shifted(bodies):
        for name in NAMES:
            bodies = beside(name, (0.15, 0.1, 0.0))(bodies)
        return bodies

    assert all(room.step(shifted) == {} for _ in range(20))
    assert room.kinds == ["jump"]
    assert room.incidents[0].robots == NAMES


def test_names_may_change_one_frame_after_the_other():
    room = Room()
    room.step(lambda bodies: {**bodies, BODIES["cf1"]: bodies[BODIES["cf2"]]})
    for _ in range(5):
        assert room.right(room.step(named(("cf2", "cf1", "cf3")))) == set(NAMES)
    assert room.kinds == ["teleport", "swap", "again"]


def test_a_body_that_is_frozen_brings_no_news_and_a_repeated_frame_does_no_harm():
    room = Room()

    def frozen(bodies):
        return {**bodies, BODIES["cf2"]: last}

    last = room.poses()[BODIES["cf2"]]
    room.step(frozen)
    assert room.right(room.step()) == set(NAMES)  # one frame twice: nobody minds
    last = room.poses()[BODIES["cf2"]]
    told = [set(room.step(frozen)) for _ in range(30)]
    assert told[0] == set(NAMES)
    assert all(names == {"cf1", "cf3"} for names in told[1:])
    assert room.kinds == ["frozen"]
    assert room.right(room.step()) == set(NAMES)  # moves on: believed by its own word


def test_what_is_no_number_is_not_seen():
    room = Room()
    nothing = Pose((math.nan, 0.0, 0.0), LEVEL)
    assert room.right(room.step(lambda bodies: {**bodies, BODIES["cf1"]: nothing})) == {"cf2", "cf3"}


def test_after_a_gap_the_drones_own_word_decides():
    room = Room()
    room.pass_unseen(0.6)
    assert room.right(room.step()) == set(NAMES)
    assert room.incidents == []
    room.pass_unseen(0.6)
    for _ in range(20):
        assert room.right(room.step(beside("cf1", (0.0, 0.0, 0.6)))) == {"cf2", "cf3"}
    assert room.kinds == ["teleport"]


def test_who_is_swapped_while_nobody_looks_is_found_out():
    room = Room()
    room.pass_unseen(0.5)
    assert room.right(room.step(named(("cf2", "cf1", "cf3")))) == set(NAMES)
    assert room.kinds == ["swap"]


def test_who_may_as_well_be_another_is_told_nothing():
    room = Room()
    room.pass_unseen(0.3)
    # Half way between two of them, and the others' bodies are still away.
    between = Pose(tuple(0.45 * room.truth("cf1") + 0.55 * room.truth("cf2")), LEVEL)
    assert room.step(lambda bodies: {BODIES["cf1"]: between}) == {}


def test_a_body_that_takes_the_place_of_one_that_is_hidden_is_believed_of_neither():
    room = Room()

    def relabelled(bodies):
        return {BODIES["cf1"]: bodies[BODIES["cf2"]], BODIES["cf3"]: bodies[BODIES["cf3"]]}

    for _ in range(50):
        assert room.right(room.step(relabelled)) == {"cf3"}
    assert room.kinds == ["teleport"]


def test_an_attitude_that_flips_is_left_out():
    room = Room()
    turned = (0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4))

    def flipped(bodies):
        return {**bodies, BODIES["cf1"]: Pose(bodies[BODIES["cf1"]].position, turned)}

    for _ in range(40):
        poses = room.step(flipped)
        assert room.right(poses) == set(NAMES)
        assert poses["cf1"].quaternion is None
        assert poses["cf2"].quaternion == LEVEL
    (incident,) = room.incidents
    assert (incident.kind, incident.robots) == ("attitude", ("cf1",))
    assert "90°" in incident.text
    assert room.step()["cf1"].quaternion == LEVEL


def test_falls_and_tumbles_and_crashes_are_believed():
    """Wild, but true: what the drone's own telemetry may not even have said yet."""
    gate = Gate({"cf1": "cf1"}, lambda robot: None)
    z, v, angle, believed = 2.0, 0.0, 0.0, 0
    for k in range(200):
        v = v - 20.0 * DT if z > 0.0 else 0.0
        z, angle = max(0.0, z + v * DT), angle + 30.0 * DT
        pose = Pose((0.0, 1e-4 * (k % 7), z), (math.sin(angle / 2), 0.0, 0.0, math.cos(angle / 2)))
        admitted = gate.admit(MocapFrame(k * DT, k, {"cf1": pose}))
        believed += admitted.poses == {"cf1": pose}
        gate.close()
    assert believed == 200


def test_before_it_is_closed_names_are_as_given():
    gate = Gate(BODIES, lambda robot: None)
    for k, x in enumerate((0.0, 5.0, -3.0)):
        assert gate.admit(MocapFrame(DT * k, k, {BODIES["cf1"]: Pose((x, 0.0, 0.0))})).poses["cf1"].position[0] == x


def test_old_frames_say_nothing():
    room = Room()
    stale = MocapFrame(room.t, room.k, room.poses())
    assert room.gate.admit(stale).poses == {}


@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_motion_that_drones_are_able_to_is_never_refused(seed):
    """Random accelerations up to 2 g, frames missing for up to the gap, two millimetres of noise."""
    rng = np.random.default_rng(seed)
    gate = Gate({"cf1": "cf1"}, lambda robot: None)
    p, v, missing = np.zeros(3), rng.normal(0.0, 1.0, 3), 0
    for k in range(150):
        a = rng.normal(size=3)
        v = v + DT * a / np.linalg.norm(a) * rng.uniform(0.0, 20.0)
        p = p + DT * v
        if k and rng.random() < 0.3 and missing < round(GAP / DT) - 1:
            missing += 1
            continue
        missing = 0
        pose = Pose(tuple(p + rng.normal(0.0, 0.002, 3)))
        assert gate.admit(MocapFrame(k * DT, k, {"cf1": pose})).poses == {"cf1": pose}
        gate.close()
