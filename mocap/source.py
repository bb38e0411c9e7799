"""The seam to motion-capture systems."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol


class Pose(NamedTuple):
    """Pose of one rigid body in the world frame.

    Attributes:
        position: x, y, z [m].
        quaternion: x, y, z, w, body to world; None when only the position is known.
    """

    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float] | None = None


@dataclass(frozen=True)
class MocapFrame:
    """One frame: a body that is not tracked in it is absent from it.

    Attributes:
        t: host clock time of the measurement [s], the flight's clock.
        number: frame number, rising.
        bodies: poses by rigid-body name.
        points: unlabelled markers [m], in any order.
        doubtful: bodies that are absent because a marker could be theirs or another's.
    """

    t: float
    number: int
    bodies: Mapping[str, Pose]
    points: tuple[tuple[float, float, float], ...] = ()
    doubtful: tuple[str, ...] = ()


class MocapSource(Protocol):
    """Where frames come from: a real system, a recording, the simulated world."""

    def poll(self) -> Sequence[MocapFrame]:
        """Frames that arrived since the last call, oldest first; never blocks. Raises MocapError when it is gone."""

    def close(self) -> None:
        """Stop; may be called again."""
