"""Rigid bodies of Vicon, OptiTrack, Qualisys, VRPN, through the ``motioncapture`` package: no markers and no times."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

from mocap.clients import Client, Quat, Report, Vec3


def connect(system: str, options: Mapping[str, str]) -> Client:
    """Connect; some systems block for ever, holding the interpreter's lock."""
    return _Bodies(importlib.import_module("motioncapture").connect(system, dict(options)))


class _Bodies:
    """Rigid bodies of a library's connection."""

    def __init__(self, library: Any) -> None:  # noqa: ANN401 - untyped library
        self._library = library

    def wait(self) -> Report:
        """The next frame."""
        self._library.waitForNextFrame()
        return Report({name: _pose(body) for name, body in self._library.rigidBodies.items()})

    def close(self) -> None:
        """The library has no way to; the process ends."""


def _pose(body: Any) -> tuple[Vec3, Quat]:  # noqa: ANN401 - untyped library
    x, y, z = map(float, body.position)
    q = body.rotation
    return (x, y, z), (float(q.x), float(q.y), float(q.z), float(q.w))
