"""Unlabelled markers of Qualisys Track Manager, through Qualisys' own package ``qtm-rt``."""

from __future__ import annotations

import asyncio
import importlib
import math
from collections.abc import Mapping
from typing import Any

from mocap.clients import Client, Report

_MILLIMETRE = 0.001  # QTM streams millimetres
_MICROSECOND = 1e-6
_TIMEOUT = 5.0  # s


def connect(system: str, options: Mapping[str, str]) -> Client:
    """Connect and ask for every frame's unlabelled markers.

    Raises:
        ImportError: the package is not installed.
        OSError: no server there, or it does not stream.
    """
    client = _Markers(importlib.import_module("qtm_rt"))
    client.open(options.get("hostname", "127.0.0.1"), int(options.get("port", "22223")))
    return client


class _Markers:
    """Unlabelled markers in metres, with the time of their exposure."""

    def __init__(self, library: Any) -> None:  # noqa: ANN401 - untyped library
        self._library = library
        self._loop = asyncio.new_event_loop()
        self._frames: asyncio.Queue[Any] = asyncio.Queue()
        self._connection: Any = None

    def open(self, host: str, port: int) -> None:
        """Connect and stream."""
        try:
            self._loop.run_until_complete(self._open(host, port))
        except BaseException:
            self.close()
            raise

    def wait(self) -> Report:
        """The next frame. Raises OSError when the server ends the stream."""
        packet = self._loop.run_until_complete(self._frames.get())
        if packet is None:
            raise OSError("the server closed the connection")
        found = packet.get_3d_markers_no_label()
        points = [(marker.x, marker.y, marker.z) for marker in (found[1] if found else ())]
        seen = [point for point in points if all(map(math.isfinite, point))]
        metres = tuple((x * _MILLIMETRE, y * _MILLIMETRE, z * _MILLIMETRE) for x, y, z in seen)
        return Report(points=metres, stamp=packet.timestamp * _MICROSECOND)

    def close(self) -> None:
        """Hang up."""
        if self._connection is not None and self._connection.has_transport():
            self._connection.disconnect()
            self._loop.run_until_complete(asyncio.sleep(0.0))  # the transport closes in the loop's next turn
        self._loop.close()

    async def _open(self, host: str, port: int) -> None:
        ended = self._frames.put_nowait
        self._connection = await self._library.connect(
            host, port=port, on_disconnect=lambda _: ended(None), timeout=_TIMEOUT
        )
        if self._connection is None:  # the library logs why and says nothing
            raise OSError(f"no Qualisys server at {host}:{port}")
        await self._connection.stream_frames(components=["3dnolabels"], on_packet=self._frames.put_nowait)
