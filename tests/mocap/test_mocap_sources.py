import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mocap.frames import CaptureFrame, MappedSource, RigidTransform
from mocap.replay import ReplayMocap
from mocap.simulated import SimulatedMocap
from mocap.source import MocapFrame, Pose
from tests.contracts import mocap as contract

LEVEL = (0.0, 0.0, 0.0, 1.0)


class Stage:
    """A simulated system and the world it watches."""

    def __init__(self, **options):
        self.now, self.ticks = 0.0, itertools.count(1)
        self.source = SimulatedMocap(100.0, seed=1, **options)

    def let_time_pass(self, attitude=LEVEL):
        self.now = next(self.ticks) * 0.01
        positions = np.array([(1.0, 2.0, self.now), (0.0, 0.0, 0.0)])
        self.source.observe(self.now, ["a", "b"], positions, None if attitude is None else np.tile(attitude, (2, 1)))


class Tape:
    """A replayed recording."""

    def __init__(self):
        self.now = 0.0
        frames = (MocapFrame(0.01 * k, k, {"a": Pose((0.0, 0.0, 0.01 * k), LEVEL)}) for k in range(1000))
        self.source = ReplayMocap(frames, lambda: self.now)

    def let_time_pass(self):
        self.now += 0.01


@pytest.mark.parametrize("make", [Stage, Tape])
def test_sources_meet_the_contract(make):
    contract.delivers_frames_in_order((s := make()).source, s.let_time_pass)
    contract.delivers_finite_poses_with_unit_quaternions((s := make()).source, s.let_time_pass)
    contract.stamps_are_not_from_the_future((s := make()).source, s.let_time_pass, lambda: s.now)
    contract.has_nothing_new_without_time(s.source)
    contract.closes_twice(s.source)
    s.let_time_pass()
    assert not s.source.poll()


def test_frames_arrive_after_the_latency():
    stage = Stage(latency=0.025)
    arrivals = []
    for _ in range(20):
        stage.let_time_pass()
        arrivals += [(frame.t, stage.now) for frame in stage.source.poll()]
    assert [round(now - t, 9) for t, now in arrivals] == [0.03] * len(arrivals)
    assert len(arrivals) == 17


@pytest.mark.parametrize("rate", [10.0, 30.0, 100.0, 120.0])
def test_frames_come_at_the_systems_own_rate(rate):
    source = SimulatedMocap(rate, latency=0.0)
    for k in range(1001):
        source.observe(0.002 * k, [], np.zeros((0, 3)))
    frames = source.poll()
    assert len(frames) == pytest.approx(2.0 * rate + 1, abs=1)
    assert max(b.t - a.t for a, b in itertools.pairwise(frames)) <= 1.0 / rate + 0.002 + 1e-9


def test_noise_has_the_stated_size_and_is_repeatable():
    def recording():
        stage = Stage(latency=0.0, noise_position=0.002, noise_angle=0.01)
        for _ in range(2000):
            stage.let_time_pass((0.6, 0.0, 0.0, 0.8))
        return stage.source.poll()

    frames = recording()
    positions = np.array([frame.bodies["a"].position for frame in frames])
    quaternions = np.array([frame.bodies["a"].quaternion for frame in frames])
    positions[:, 2] -= [frame.t for frame in frames]
    np.testing.assert_allclose(positions.mean(axis=0), (1.0, 2.0, 0.0), atol=2e-4)
    np.testing.assert_allclose(positions.std(axis=0), 0.002, rtol=0.1)
    angle = 2.0 * np.arccos(np.clip(quaternions @ (0.6, 0.0, 0.0, 0.8), -1.0, 1.0))
    assert np.sqrt((angle**2).mean()) == pytest.approx(0.01 * math.sqrt(3.0), rel=0.1)
    assert recording() == frames


def test_a_small_turn_is_about_the_worlds_axes():
    source = SimulatedMocap(100.0, noise_position=0.0, noise_angle=1e-3, seed=3)
    body = (0.5, 0.5, 0.5, 0.5)
    turned = RigidTransform(tuple(source._turned(np.array([body]), np.array([[0.0, 0.0, 1.0]]))[0]))
    apart = turned.after(RigidTransform(body).inverse()).quaternion
    assert apart == pytest.approx((0.0, 0.0, 0.5e-3, 1.0), abs=1e-6)


def test_hidden_bodies_are_absent_and_the_others_seen_as_ever():
    def second_frame(hidden):
        stage = Stage(latency=0.0)
        stage.let_time_pass()
        stage.source.hide(hidden)
        stage.let_time_pass()
        return stage.source.poll()[1]

    with_all, without_a = second_frame(set()), second_frame({"a"})
    assert set(without_a.bodies) == {"b"}
    assert without_a.bodies["b"] == with_all.bodies["b"]


@pytest.mark.parametrize("options", [{"latency": -0.1}, {"noise_position": -1.0}, {"noise_angle": -1.0}])
def test_impossible_systems_are_refused(options):
    with pytest.raises(ValueError, match="capture system"):
        SimulatedMocap(100.0, **options)
    with pytest.raises(ValueError, match="positive rate"):
        SimulatedMocap(0.0)


numbers = st.floats(-10.0, 10.0)
vectors = st.tuples(numbers, numbers, numbers)
transforms = st.builds(
    RigidTransform, st.tuples(numbers, numbers, numbers, numbers).filter(lambda q: math.hypot(*q) > 0.1), vectors
)


@given(transforms, transforms, vectors)
def test_transforms_compose_and_invert(a, b, p):
    assert a.after(b).point(p) == pytest.approx(a.point(b.point(p)), abs=1e-9)
    assert a.inverse().point(a.point(p)) == pytest.approx(p, abs=1e-9)


@given(transforms, vectors, vectors)
def test_transforms_keep_distances(a, p, q):
    assert math.dist(a.point(p), a.point(q)) == pytest.approx(math.dist(p, q), abs=1e-9)


@given(transforms, transforms, vectors)
def test_a_pose_is_transformed_like_the_points_of_its_body(a, body, p):
    moved = a.pose(Pose(body.translation, body.quaternion))
    assert RigidTransform(moved.quaternion, moved.position).point(p) == pytest.approx(a.point(body.point(p)), abs=1e-9)


def test_a_y_up_frame_becomes_z_up_without_mirroring():
    world = RigidTransform.from_up_axis("y")
    assert world.point((1.0, 2.0, 3.0)) == pytest.approx((1.0, -3.0, 2.0))
    assert RigidTransform.from_up_axis("z").point((1.0, 2.0, 3.0)) == (1.0, 2.0, 3.0)
    with pytest.raises(ValueError, match="'y' or 'z'"):
        RigidTransform.from_up_axis("x")


def test_a_transformed_source_is_a_source_in_the_world_frame():
    stage = Stage(noise_position=0.0, noise_angle=0.0, latency=0.0)
    source = MappedSource(stage.source, CaptureFrame(RigidTransform.from_yaw(math.pi / 2, (10.0, 0.0, 0.0))).to_world)
    stage.let_time_pass()
    (frame,) = source.poll()
    assert frame.bodies["a"].position == pytest.approx((8.0, 1.0, 0.01))
    stage.let_time_pass(attitude=None)
    (frame,) = source.poll()
    assert frame.bodies["b"].position == pytest.approx((10.0, 0.0, 0.0))
    assert frame.bodies["b"].quaternion is None
    contract.closes_twice(source)
