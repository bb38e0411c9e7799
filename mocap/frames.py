"""From the motion-capture system's frame to the world frame.

A capture volume has its own origin, and some systems have y up. Everything downstream is in the world frame, z up; the
one place where the two meet is a :class:`RigidTransform`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
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

    def frame(self, frame: MocapFrame) -> MocapFrame:
        """Transform all bodies of a frame."""
        return replace(frame, bodies={name: self.pose(pose) for name, pose in frame.bodies.items()})


class TransformedSource:
    """A source whose frames are in another frame of reference.

    Args:
        source: where the frames come from; closed with this one.
        world_from_capture: what to apply.
    """

    def __init__(self, source: MocapSource, world_from_capture: RigidTransform) -> None:
        self._source, self._transform = source, world_from_capture

    def poll(self) -> Sequence[MocapFrame]:
        """New frames, oldest first, in the world frame."""
        return [self._transform.frame(frame) for frame in self._source.poll()]

    def close(self) -> None:
        """Close the source."""
        self._source.close()


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
