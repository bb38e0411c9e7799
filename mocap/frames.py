"""From the motion-capture system's frame to the world frame.

A capture volume has its own origin, and some systems have y up. Everything downstream is in the world frame, z up; the
one place where the two meet is a :class:`CaptureFrame`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from mocap.source import MocapFrame, MocapSource, Pose

Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]


@dataclass(frozen=True)
class RigidTransform:
    """World from capture frame: first turn, then shift.

    Attributes:
        quaternion: x, y, z, w of unit length; turns vectors of the capture frame into the world frame.
        translation: the capture frame's origin in the world frame [m].
    """

    quaternion: Quat = (0.0, 0.0, 0.0, 1.0)
    translation: Vec3 = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        norm = math.sqrt(sum(c * c for c in self.quaternion))
        if not math.isfinite(norm) or norm < 1e-9 or not all(map(math.isfinite, self.translation)):
            raise ValueError(f"a rigid transform needs a non-zero quaternion and finite numbers; got {self}")
        x, y, z, w = (c / norm for c in self.quaternion)
        object.__setattr__(self, "quaternion", (x, y, z, w))

    @staticmethod
    def from_up_axis(up: str) -> RigidTransform:
        """World (z up) from a capture frame whose ``up`` axis points up: ``"z"``, or ``"y"`` (x stays x, -z becomes y).

        Raises:
            ValueError: any other axis.
        """
        if up == "z":
            return RigidTransform()
        if up == "y":
            return RigidTransform((math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)))
        raise ValueError(f"the up axis of a capture frame is 'y' or 'z'; got {up!r}")

    @staticmethod
    def from_yaw(yaw: float, translation: Vec3 = (0.0, 0.0, 0.0)) -> RigidTransform:
        """Turn about the vertical [rad], then shift [m]."""
        return RigidTransform((0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)), translation)

    def after(self, first: RigidTransform) -> RigidTransform:
        """The transform that does ``first``, then this one."""
        return RigidTransform(_multiply(self.quaternion, first.quaternion), self.point(first.translation))

    def inverse(self) -> RigidTransform:
        """Capture frame from world."""
        x, y, z, w = self.quaternion
        back = RigidTransform((-x, -y, -z, w))
        tx, ty, tz = back.point(self.translation)
        return replace(back, translation=(-tx, -ty, -tz))

    def point(self, p: Vec3) -> Vec3:
        """Transform a point [m]."""
        x, y, z, w = self.quaternion
        # v + 2 u × (u × v + w v), u the quaternion's vector part
        cx, cy, cz = y * p[2] - z * p[1] + w * p[0], z * p[0] - x * p[2] + w * p[1], x * p[1] - y * p[0] + w * p[2]
        tx, ty, tz = self.translation
        return (
            p[0] + 2.0 * (y * cz - z * cy) + tx,
            p[1] + 2.0 * (z * cx - x * cz) + ty,
            p[2] + 2.0 * (x * cy - y * cx) + tz,
        )

    def pose(self, pose: Pose) -> Pose:
        """Transform a body's pose; an unknown attitude stays unknown."""
        turned = None if pose.quaternion is None else _multiply(self.quaternion, pose.quaternion)
        return Pose(self.point(pose.position), turned)


@dataclass(frozen=True)
class CaptureFrame:
    """The frame a capture system reports in.

    Attributes:
        placement: world from capture frame, once that has z up and metres.
        up: its axis that points up, ``"z"`` or ``"y"``. Bodies are defined in the same convention: a level body whose
            orientation is reported as none has its own y axis up as well, so axes of room and body are renamed alike.
        unit: length of its unit [m].
    """

    placement: RigidTransform = RigidTransform()
    up: str = "z"
    unit: float = 1.0

    def to_world(self, frame: MocapFrame) -> MocapFrame:
        """A frame as reported, in the world frame, z up, metres."""
        axes = RigidTransform.from_up_axis(self.up)
        return _mapped(frame, lambda pose: self.placement.pose(_renamed(_scaled(pose, self.unit), axes)))

    def from_world(self, frame: MocapFrame) -> MocapFrame:
        """A frame of the world, as the system would report it."""
        axes, back = RigidTransform.from_up_axis(self.up).inverse(), self.placement.inverse()
        return _mapped(frame, lambda pose: _scaled(_renamed(back.pose(pose), axes), 1.0 / self.unit))


class MappedSource:
    """A source whose frames are those of another, changed one by one.

    Args:
        source: where the frames come from; closed with this one.
        change: makes the new frame.
    """

    def __init__(self, source: MocapSource, change: Callable[[MocapFrame], MocapFrame]) -> None:
        self._source, self._change = source, change

    def poll(self) -> Sequence[MocapFrame]:
        """New frames, oldest first."""
        return [self._change(frame) for frame in self._source.poll()]

    def close(self) -> None:
        """Close the source."""
        self._source.close()


def _mapped(frame: MocapFrame, change: Callable[[Pose], Pose]) -> MocapFrame:
    """All bodies and points of a frame."""
    points = tuple(change(Pose(point)).position for point in frame.points)
    return replace(frame, bodies={name: change(pose) for name, pose in frame.bodies.items()}, points=points)


def _scaled(pose: Pose, factor: float) -> Pose:
    x, y, z = pose.position
    return Pose((x * factor, y * factor, z * factor), pose.quaternion)


def _renamed(pose: Pose, axes: RigidTransform) -> Pose:
    """The same pose with other names for the axes of the room, and those of the body alike."""
    if pose.quaternion is None:
        return Pose(axes.point(pose.position))
    turned = _multiply(_multiply(axes.quaternion, pose.quaternion), axes.inverse().quaternion)
    return Pose(axes.point(pose.position), turned)


def _multiply(a: Quat, b: Quat) -> Quat:
    """Hamilton product: first b, then a."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )
