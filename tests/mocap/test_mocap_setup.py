import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.loader import parse_mission
from mocap.frames import CaptureFrame, RigidTransform
from mocap.setup import in_world, seen_by
from mocap.source import MocapFrame, Pose

MISSION = """
schema_version: 1
name: m
workspace: {lower: [0, 0], upper: [3, 3]}
horizon: {duration: 10.0}
information: {type: uniform}
robots:
  - {name: a, start: [0.5, 0.5], rigid_body: body_a}
  - {name: b, start: [2.5, 0.5], pad: [2.0, 0.5]}
limits: {acceleration: 0.5}
"""
LEVEL = (0.0, 0.0, 0.0, 1.0)
PADS = {"body_a": (0.5, 0.5, 0.0), "b": (2.0, 0.5, 0.0)}


def mission(setup=""):
    return parse_mission(MISSION + setup, path="m.yaml", read_file=lambda _: b"")


class Frames:
    def __init__(self, frames):
        self.frames, self.closed = list(frames), False

    def poll(self):
        frames, self.frames = self.frames, []
        return frames

    def close(self):
        self.closed = True


def film(bodies, count=20):
    return Frames(MocapFrame(0.01 * k, k, bodies) for k in range(count))


def test_a_mission_that_says_nothing_gets_what_the_system_reports():
    source = film({})
    assert in_world(source, mission()) is source
    assert seen_by(source, mission()) is source


numbers = st.floats(-5.0, 5.0)
quaternions = st.tuples(numbers, numbers, numbers, numbers).filter(lambda q: math.hypot(*q) > 0.1)
unit = st.builds(lambda q: tuple(c / math.hypot(*q) for c in q), quaternions)


@given(
    st.sampled_from(["y", "z"]),
    st.sampled_from([1.0, 0.001, 0.3048]),
    numbers,
    st.tuples(numbers, numbers, numbers),
    st.tuples(numbers, numbers, numbers),
    unit,
)
def test_what_a_system_reports_comes_back_as_it_was(up, size, yaw, origin, position, quaternion):
    frame = CaptureFrame(RigidTransform.from_yaw(yaw, origin), up, size)
    there = frame.from_world(MocapFrame(1.0, 1, {"a": Pose(position, quaternion)}, (position,)))
    back = frame.to_world(there)
    assert back.bodies["a"].position == pytest.approx(position, abs=1e-9)
    assert back.points[0] == pytest.approx(position, abs=1e-9)
    same = sum(a * b for a, b in zip(back.bodies["a"].quaternion, quaternion, strict=True))
    assert abs(same) == pytest.approx(1.0, abs=1e-9)


def test_a_level_body_of_a_y_up_system_in_millimetres_is_level_in_the_world():
    """Motive, y up: a body that was defined level has no rotation; turned about the vertical it turns about y."""
    frame = CaptureFrame(up="y", unit=0.001)
    quarter = (0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5))
    world = frame.to_world(
        MocapFrame(0.0, 1, {"a": Pose((1000.0, 600.0, -2000.0), LEVEL), "b": Pose((0.0, 0.0, 0.0), quarter)})
    )
    assert world.bodies["a"] == Pose(pytest.approx((1.0, 2.0, 0.6)), pytest.approx(LEVEL))
    assert world.bodies["b"].quaternion == pytest.approx((0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))


def test_a_system_turned_in_the_room_turns_bodies_with_it():
    frame = CaptureFrame(RigidTransform.from_yaw(math.pi / 2, (1.0, 0.0, 0.0)))
    world = frame.to_world(MocapFrame(0.0, 1, {"a": Pose((1.0, 0.0, 0.5), LEVEL)}, ((0.0, 1.0, 0.0),)))
    assert world.bodies["a"].position == pytest.approx((1.0, 1.0, 0.5))
    assert world.bodies["a"].quaternion == pytest.approx((0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))
    assert world.points[0] == pytest.approx((0.0, 0.0, 0.0))


def test_a_markers_height_is_along_the_tilted_body():
    tilted = (0.0, math.sin(0.25), 0.0, math.cos(0.25))  # 0.5 rad nose down
    source = in_world(film({"body_a": Pose((0.0, 0.0, 1.0), tilted)}, 1), mission("motion_capture: {height: 0.02}"))
    (frame,) = source.poll()
    expected = (-0.02 * math.sin(0.5), 0.0, 1.0 - 0.02 * math.cos(0.5))
    assert frame.bodies["body_a"].position == pytest.approx(expected)


@pytest.mark.parametrize("tracking", ["bodies", "positions", "markers"])
def test_what_is_seen_of_the_world_is_the_world_again(tracking):
    rehearsed = mission(f"motion_capture: {{tracking: {tracking}, height: 0.02, up: y, unit: 0.001, yaw: 1.0}}")
    bodies = {name: Pose(position, LEVEL) for name, position in PADS.items()}
    raw = seen_by(film(bodies), rehearsed, seed=1).poll()
    assert max(map(abs, [*raw[0].points, *(p.position for p in raw[0].bodies.values())][0])) > 100.0
    assert bool(raw[0].points) == (tracking == "markers")
    *_, last = in_world(Frames(raw), rehearsed).poll()
    assert set(last.bodies) == set(PADS)
    for name, pose in last.bodies.items():
        assert pose.position == pytest.approx(PADS[name], abs=1e-9)
        assert (pose.quaternion is None) == (tracking != "bodies")


def test_a_known_latency_dates_frames_back():
    source = in_world(film({"b": Pose((0.0, 0.0, 0.0))}, 2), mission("motion_capture: {latency: 0.015}"))
    assert [frame.t for frame in source.poll()] == pytest.approx([-0.015, -0.005])


def test_markers_come_in_no_order():
    rehearsed = mission("motion_capture: {tracking: markers}")
    raw = seen_by(film({name: Pose(position) for name, position in PADS.items()}), rehearsed, seed=1).poll()
    assert len({frame.points for frame in raw}) == 2
    assert not raw[0].bodies


def test_closing_goes_all_the_way_down():
    source = film({})
    in_world(source, mission("motion_capture: {tracking: markers, up: y}")).close()
    assert source.closed
