"""One port of this computer: the page, its feed, and Foxglove's protocol.

Only this computer can connect, and only pages that came from here, or Foxglove itself, may listen: a browser tells
whose page asks, and a name that was pointed at this computer is not one of ours.
"""

from __future__ import annotations

import http
import socket
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from urllib.parse import urlsplit

from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.sync.server import ServerConnection, serve
from websockets.typing import Subprotocol

from deploy.errors import DeployError
from deploy.live.foxglove import SUBPROTOCOLS, Topics
from deploy.live.frames import Frames
from deploy.live.page import build_page
from planner.flightplan import FlightPlan

HOST = "127.0.0.1"
PORT = 8765  # Foxglove's own
PATIENCE = 2.0  # s, after the flight, for those who are behind
_OURS = ("127.0.0.1", "localhost")
_VIEWERS = ("app.foxglove.dev", *_OURS)
_FEED = "/feed"


@dataclass(frozen=True)
class Live:
    """A flight that can be watched: where, and what has to be told.

    Attributes:
        url: of the page. frames: its observer. topics: is told every record of the log.
    """

    url: str
    frames: Frames
    topics: Topics


@contextmanager
def live(flight_plan: FlightPlan, port: int = PORT) -> Iterator[Live]:
    """While inside, a flight can be watched.

    Args:
        flight_plan: what flies.
        port: of this computer; 0 takes any that is free.

    Raises:
        DeployError: the port is taken.
    """
    mission = flight_plan.mission
    frames, topics = Frames([robot.name for robot in mission.robots]), Topics(f"ergoflie {mission.name}")
    page = build_page(flight_plan).encode()

    def answer(connection: ServerConnection, request: Request) -> Response | None:
        return _answer(connection, request, page)

    audience = _Audience()

    def attend(connection: ServerConnection) -> None:
        with audience.seat(connection), suppress(ConnectionClosed):
            if connection.subprotocol in SUBPROTOCOLS:
                _topics(connection, topics)
            else:
                _frames(connection, frames)

    try:
        server = serve(
            attend,
            HOST,
            port,
            process_request=answer,
            select_subprotocol=_subprotocol,
            compression=None,
            server_header=None,
        )
    except OSError as error:
        raise DeployError(f"port {port} of this computer cannot be served: {error.strerror or error}") from error
    thread = threading.Thread(target=server.serve_forever, name="live", daemon=True)
    thread.start()
    try:
        yield Live(f"http://{HOST}:{server.socket.getsockname()[1]}/", frames, topics)
    finally:
        frames.end()
        topics.end()
        server.shutdown()
        thread.join()
        audience.leave(PATIENCE)


class _Audience:
    """Everybody who is connected. Who does not listen any more must not keep the program from ending."""

    def __init__(self) -> None:
        self._connections: set[ServerConnection] = set()
        self._changed = threading.Condition()

    @contextmanager
    def seat(self, connection: ServerConnection) -> Iterator[None]:
        """While inside, this connection is one of them."""
        with self._changed:
            self._connections.add(connection)
        try:
            yield
        finally:
            with self._changed:
                self._connections.discard(connection)
                self._changed.notify_all()

    def leave(self, patience: float) -> None:
        """Let them hear the end, for some seconds; then hang up."""
        with self._changed:
            self._changed.wait_for(lambda: not self._connections, patience)
            for connection in self._connections:
                with suppress(OSError):
                    connection.socket.shutdown(socket.SHUT_RDWR)


def _frames(connection: ServerConnection, frames: Frames) -> None:
    outlet = frames.join()
    try:
        outlet.drain(connection.send)
    finally:
        frames.leave(outlet)


def _topics(connection: ServerConnection, topics: Topics) -> None:
    viewer = topics.join()

    def send() -> None:
        try:
            viewer.outlet.drain(connection.send)
        except ConnectionClosed:
            return
        connection.close()

    sender = threading.Thread(target=send, name="foxglove", daemon=True)
    sender.start()
    try:
        for message in connection:
            topics.heard(viewer, message)
    finally:
        topics.leave(viewer)
        sender.join()


def _answer(connection: ServerConnection, request: Request, page: bytes) -> Response | None:
    """The page, a refusal, or None to go on with a WebSocket."""
    port = connection.local_address[1]
    if request.headers.get("Host", "") not in {f"{name}:{port}" for name in _OURS}:
        return connection.respond(http.HTTPStatus.FORBIDDEN, "only for this computer\n")
    if "Upgrade" not in request.headers:
        return _page(connection, request, page)
    wants_topics = any(name in request.headers.get("Sec-WebSocket-Protocol", "") for name in SUBPROTOCOLS)
    if not (wants_topics or request.path == _FEED):
        return connection.respond(http.HTTPStatus.NOT_FOUND, f"got {request.path}; allowed: {_FEED}\n")
    allowed = _VIEWERS if wants_topics else _OURS
    if not _welcome(request.headers.get("Origin"), allowed):
        return connection.respond(http.HTTPStatus.FORBIDDEN, "not for pages of others\n")
    return None


def _page(connection: ServerConnection, request: Request, page: bytes) -> Response:
    if request.path != "/":
        return connection.respond(http.HTTPStatus.NOT_FOUND, "there is one page here: /\n")
    response = connection.respond(http.HTTPStatus.OK, "")
    for name in ("Content-Type", "Content-Length"):
        del response.headers[name]
    response.headers["Content-Type"] = "text/html; charset=utf-8"
    response.headers["Content-Length"] = str(len(page))
    response.headers["Cache-Control"] = "no-store"
    response.body = page
    return response


def _welcome(origin: str | None, hosts: Sequence[str]) -> bool:
    """Whether a page of this origin may listen; programs that are no browsers name none, or one of their own."""
    if origin is None:
        return True
    parts = urlsplit(origin)
    return parts.hostname in hosts if parts.scheme in ("http", "https") else origin != "null"


def _subprotocol(connection: ServerConnection, offered: Sequence[Subprotocol]) -> Subprotocol | None:
    return next((name for name in offered if name in SUBPROTOCOLS), None)
