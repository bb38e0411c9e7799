"""The log's topics over Foxglove's WebSocket protocol (https://github.com/foxglove/ws-protocol, version 1).

Foxglove connects to ``ws://localhost:PORT``, as does any client of ``foxglove.websocket.v1``. Whoever subscribes to a
topic first gets its newest record: map and scene are written only once.
"""

from __future__ import annotations

import json
import struct
import threading
from collections.abc import Mapping, Sequence
from typing import Any

from deploy.flightlog.schema import json_schema
from deploy.flightlog.topics import find_topic
from deploy.live.outlet import Outlet

SUBPROTOCOLS = ("foxglove.websocket.v1", "foxglove.sdk.v1")
_DATA = struct.Struct("<BIQ")  # opcode 1, subscription, time [ns]
Out = str | bytes


class Viewer:
    """One who watches: outlet, and channel by subscription."""

    def __init__(self) -> None:
        self.outlet: Outlet[Out] = Outlet()
        self.subscriptions: dict[int, int] = {}  # by subscription: channel


class Topics:
    """The topics so far, their newest records, and who wants them."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._channels: dict[str, int] = {}
        self._newest: dict[int, tuple[int, bytes]] = {}
        self._viewers: list[Viewer] = []
        self._lock = threading.Lock()

    def record(self, time: int, topic: str, data: bytes) -> None:
        """A record that was just written to the log, at ``time`` [ns]."""
        channel = self._channels.get(topic)
        if channel is None:
            channel = self._declare(topic)
        self._newest[channel] = (time, data)
        if self._viewers:
            with self._lock:
                for viewer in self._viewers:
                    _send(viewer, channel, time, data)

    def join(self) -> Viewer:
        """Somebody new: he is told what there is."""
        viewer = Viewer()
        info = {"op": "serverInfo", "name": self._name, "capabilities": [], "metadata": {}, "sessionId": self._name}
        with self._lock:
            viewer.outlet.put(json.dumps(info))
            viewer.outlet.put(
                json.dumps({"op": "advertise", "channels": [_channel(*i) for i in self._channels.items()]})
            )
            self._viewers.append(viewer)
        return viewer

    def leave(self, viewer: Viewer) -> None:
        """He is gone."""
        with self._lock:
            self._viewers.remove(viewer)
        viewer.outlet.close()

    def end(self) -> None:
        """Nothing more will come."""
        with self._lock:
            for viewer in self._viewers:
                viewer.outlet.close()

    def heard(self, viewer: Viewer, message: str | bytes) -> None:
        """What he said; what we do not understand is answered with a status."""
        try:
            said: Any = json.loads(message)
            if said["op"] == "subscribe":
                self._subscribe(viewer, {int(item["id"]): int(item["channelId"]) for item in said["subscriptions"]})
            elif said["op"] == "unsubscribe":
                self._unsubscribe(viewer, [int(number) for number in said["subscriptionIds"]])
            else:
                raise ValueError(f"got {said['op']}; allowed: subscribe, unsubscribe")
        except (ValueError, LookupError, TypeError) as error:
            viewer.outlet.put(json.dumps({"op": "status", "level": 1, "message": f"not understood: {error}"}))

    def _subscribe(self, viewer: Viewer, wanted: Mapping[int, int]) -> None:
        with self._lock:
            viewer.subscriptions |= wanted
            for channel in wanted.values():
                if channel in self._newest:
                    _send(viewer, channel, *self._newest[channel])

    def _unsubscribe(self, viewer: Viewer, subscriptions: Sequence[int]) -> None:
        with self._lock:
            for number in subscriptions:
                viewer.subscriptions.pop(number, None)

    def _declare(self, topic: str) -> int:
        with self._lock:
            channel = self._channels.setdefault(topic, len(self._channels) + 1)
            text = json.dumps({"op": "advertise", "channels": [_channel(topic, channel)]})
            for viewer in self._viewers:
                viewer.outlet.put(text)
        return channel


def _send(viewer: Viewer, channel: int, time: int, data: bytes) -> None:
    for subscription, wanted in viewer.subscriptions.items():
        if wanted == channel:
            viewer.outlet.put(_DATA.pack(1, subscription, time) + data)


def _channel(name: str, number: int) -> dict[str, object]:
    topic, _ = find_topic(name)
    return {
        "id": number,
        "topic": name,
        "encoding": "json",
        "schemaName": topic.schema,
        "schema": json_schema(topic),
        "schemaEncoding": "jsonschema",
    }
