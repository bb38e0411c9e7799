"""The operator's words over a socket, from this computer only: ``ergoflie control`` to ``ergoflie fly --control``.

One line a connection, ``ergoflie land`` and the like, and one line back. Whatever else arrives is refused and heard by
nobody; the prefix keeps web pages that talk to local ports from being understood.
"""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol, get_args

from deploy.errors import DeployError
from deploy.operator import Word

HOST = "127.0.0.1"
WORDS: tuple[Word, ...] = get_args(Word)
_PREFIX = "ergoflie "
_MAP = "map "  # begins what is no word but a map, as JSON in one line
_LONGEST = 60_000  # bytes of a line
_PIECE = 4096  # bytes read at a time, and of whatever follows a line that is too long
_PATIENCE = 2.0  # s for a line, and for an answer
_POLL = 0.2  # s


class Listener(Protocol):
    """Who is told."""

    def say(self, word: Word) -> None:
        """Take a word, from any thread, and return at once."""

    def tell_map(self, text: str) -> None:
        """Take a map, from any thread, and return at once."""


@contextmanager
def listening(port: int, listener: Listener) -> Iterator[int]:
    """While inside, words that arrive at a port of this computer are the operator's; yields the port.

    Args:
        port: where to listen; 0: any that is free.
        listener: who is told.

    Raises:
        DeployError: the port is taken.
    """
    try:
        server = socket.create_server((HOST, port))
    except OSError as error:
        raise DeployError(f"control port {port}: {error.strerror or error}; choose another with --control") from error
    over = threading.Event()
    server.settimeout(_POLL)
    thread = threading.Thread(target=_serve, args=(server, listener, over), name="control", daemon=True)
    thread.start()
    try:
        yield int(server.getsockname()[1])
    finally:
        over.set()
        thread.join(_PATIENCE + 2.0 * _POLL)
        server.close()


def tell(port: int, word: Word) -> str:
    """Say a word to the flight that listens at a port; returns its answer.

    Raises:
        DeployError: nobody listens there, or does not understand.
    """
    return _said(port, word)


def tell_map(port: int, text: str) -> str:
    """Tell the flight that listens at a port another map, as JSON in one line; returns its answer.

    Whether the map can be flown, the flight says in its events.

    Raises:
        DeployError: as :func:`tell`, or the map is too long.
    """
    if "\n" in text or len(text.encode()) > _LONGEST - 100:
        raise DeployError(f"a map of {len(text)} characters; allowed: one line of at most {_LONGEST - 100} bytes")
    return _said(port, _MAP + text)


def _said(port: int, word: str) -> str:
    try:
        with socket.create_connection((HOST, port), timeout=_PATIENCE) as link:
            link.sendall(f"{_PREFIX}{word}\n".encode())
            answer = _line(link)
    except OSError as error:
        why = error.strerror or error
        raise DeployError(f"no flight listens at port {port} ({why}); was it given --control?") from error
    if not answer.startswith("ok"):
        raise DeployError(f"port {port} does not understand: {answer[:60]!r}")
    return answer


def _serve(server: socket.socket, listener: Listener, over: threading.Event) -> None:
    while not over.is_set():
        try:
            link, _ = server.accept()
        except OSError:  # nobody came, or the socket is closed
            continue
        with link:
            link.settimeout(_PATIENCE)
            try:
                link.sendall(_hear(_line(link), listener).encode())
                link.shutdown(socket.SHUT_WR)
                link.recv(_PIECE)  # closing on what was not read would take the answer back
            except OSError:
                continue  # whoever it was is gone; what was understood counts


def _hear(line: str, listener: Listener) -> str:
    for word in WORDS:
        if line == _PREFIX + word:
            listener.say(word)
            return f"ok: {word}\n"
    if line.startswith(_PREFIX + _MAP):
        listener.tell_map(line.removeprefix(_PREFIX + _MAP))
        return "ok: map\n"
    return f"not understood; allowed: {', '.join(_PREFIX + word for word in WORDS)}\n"


def _line(link: socket.socket) -> str:
    data = b""
    while not data.endswith(b"\n") and len(data) < _LONGEST:
        piece = link.recv(_PIECE)
        if not piece:
            break
        data += piece
    return data.decode("ascii", "replace").rstrip("\r\n")
