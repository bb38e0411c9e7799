"""Unlabelled markers of OptiTrack Motive, through the ``natnet`` package."""

from __future__ import annotations

import importlib
import queue
from collections.abc import Mapping
from typing import Any

from mocap.clients import Client, Report, Vec3

_TIMEOUT = 5.0  # s


def connect(system: str, options: Mapping[str, str]) -> Client:
    """Connect; Motive has to stream unlabelled markers.

    Options: ``hostname`` of Motive, ``interface_ip`` of this computer, ``multicast`` (``true`` unless Motive is set to
    unicast), ``port_command``, ``port_data``.

    Raises:
        ImportError: the package is not installed.
        OSError: no server there.
    """
    library = importlib.import_module("natnet")
    host = options.get("hostname", "127.0.0.1")
    client = library.NatNetClient(
        server_ip_address=host,
        local_ip_address=options.get("interface_ip", "0.0.0.0"),
        command_port=int(options.get("port_command", "1510")),
        data_port=int(options.get("port_data", "1511")),
        use_multicast=options.get("multicast", "true") == "true",
    )
    try:
        client.connect(_TIMEOUT)
    except (TimeoutError, library.NatNetError) as error:
        raise OSError(f"no answer from Motive at {host} ({error or 'time is up'})") from error
    return _Markers(client)


class _Markers:
    """Unlabelled markers [m], with Motive's time of the frame."""

    def __init__(self, client: Any) -> None:  # noqa: ANN401 - untyped library
        self._client, self._frames = client, queue.SimpleQueue[Any]()
        client.on_data_frame_received_event.handlers.append(self._frames.put)
        client.run_async()

    def wait(self) -> Report:
        """The next frame."""
        frame = self._frames.get()
        return Report(points=_points(frame), stamp=float(frame.suffix.timestamp))

    def close(self) -> None:
        """Hang up."""
        self._client.shutdown()


def _points(frame: Any) -> tuple[Vec3, ...]:  # noqa: ANN401 - untyped library
    """The list of unlabelled markers; Motive 2 and later may send them among the labelled ones, marked as such."""
    found = list(frame.unlabeled_marker_pos)
    if not found:
        found = [marker.pos for marker in frame.labeled_markers or () if marker.unlabeled and not marker.occluded]
    return tuple((float(x), float(y), float(z)) for x, y, z in found)
