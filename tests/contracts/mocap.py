"""What every motion-capture source must do: plain functions that take a source.

``let_time_pass()`` brings at least one new frame with a body in it (or, on hardware, waits for one).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence

from mocap.source import MocapFrame, MocapSource


def polls(source: MocapSource, let_time_pass: Callable[[], None], rounds: int = 4) -> list[MocapFrame]:
    """Poll several times; the frames of all rounds."""
    frames: list[MocapFrame] = []
    for _ in range(rounds):
        let_time_pass()
        frames.extend(source.poll())
    return frames


def delivers_frames_in_order(source: MocapSource, let_time_pass: Callable[[], None]) -> None:
    frames = polls(source, let_time_pass)
    assert len(frames) >= 2
    assert all(a.number < b.number and a.t <= b.t for a, b in itertools.pairwise(frames))
    assert len({frame.number for frame in frames}) == len(frames)


def delivers_finite_poses_with_unit_quaternions(source: MocapSource, let_time_pass: Callable[[], None]) -> None:
    poses = [pose for frame in polls(source, let_time_pass) for pose in frame.bodies.values()]
    assert poses
    for pose in poses:
        assert len(pose.position) == 3
        assert all(math.isfinite(x) for x in pose.position)
        if pose.quaternion is not None:
            assert math.isclose(math.hypot(*pose.quaternion), 1.0, abs_tol=1e-5)


def has_nothing_new_without_time(source: MocapSource) -> None:
    source.poll()
    assert not source.poll()


def stamps_are_not_from_the_future(
    source: MocapSource, let_time_pass: Callable[[], None], now: Callable[[], float]
) -> None:
    frames = polls(source, let_time_pass)
    assert max(frame.t for frame in frames) <= now() + 1e-6


def closes_twice(source: MocapSource) -> None:
    source.close()
    source.close()


def all_frames(frames: Sequence[MocapFrame], name: str) -> bool:
    """Whether a body is seen in every frame."""
    return all(name in frame.bodies for frame in frames)
