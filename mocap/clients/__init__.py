"""The libraries that talk to motion-capture systems, one module each, for the child process only (``mocap/child.py``).

Every module has ``connect(system, options) -> Client``; options is what the library calls settings, e.g. ``hostname``.
A library that is not installed raises ImportError, a system that does not answer OSError, RuntimeError or ValueError.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]


@dataclass(frozen=True)
class Report:
    """One frame as a system reports it, in its own frame and units.

    Attributes:
        bodies: position and quaternion (x, y, z, w) of each rigid body that is tracked.
        points: unlabelled markers.
        stamp: time of the exposure by the system's own clock [s]; None if it does not say.
    """

    bodies: Mapping[str, tuple[Vec3, Quat]] = field(default_factory=dict)
    points: tuple[Vec3, ...] = ()
    stamp: float | None = None


class Client(Protocol):
    """A connection to a system."""

    def wait(self) -> Report:
        """The next frame; blocks until there is one."""

    def close(self) -> None:
        """End the connection."""
