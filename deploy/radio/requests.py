"""Acknowledged requests: the answers cflib throws away.

cflib sends most commands without looking at the drone's answer, and waits for ever where it does look. Here every
request names the first bytes of its answer; whoever sent it gets a :class:`Reply` that the radio's thread fills in.
The caller either polls it from the flight loop (never blocking the swarm) or, in a worker thread, waits with a
deadline and repeats.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any, TypeAlias, TypeVar

from cflib.crtp.crtpstack import CRTPPacket, CRTPPort

from deploy.errors import LinkError

ANSWERING_PORTS = (
    CRTPPort.PARAM,
    CRTPPort.MEM,
    CRTPPort.SETPOINT_HL,
    CRTPPort.SUPERVISOR,
    CRTPPort.PLATFORM,
    CRTPPort.LINKCTRL,
)


@dataclass(frozen=True)
class Request:
    """One packet that is answered.

    Attributes:
        port, channel: where it goes, and where its answer comes from.
        payload: its bytes, at most 30.
        answer: first bytes of its answer.
        what: its name in error messages.
        answer_channel: channel of the answer; default: the same.
    """

    port: int
    channel: int
    payload: bytes
    answer: bytes
    what: str
    answer_channel: int | None = None

    @property
    def key(self) -> tuple[int, int, bytes]:
        """What an answer has to match."""
        channel = self.channel if self.answer_channel is None else self.answer_channel
        return self.port, channel, self.answer


T = TypeVar("T")
# Says what to ask next, is sent the answer, and returns what came of it all; any request may be asked more than once.
Conversation: TypeAlias = Generator[Request, bytes, T]


class Reply:
    """The answer to one request, when it has come.

    Attributes:
        request: what was asked.
        sent: flight time it was (last) sent at [s].
        arrived: flight time the answer came at [s]; None until then.
        repeated: whether it was sent more than once: then the answer may be to the second copy.
        payload: the whole answer; empty until then.
    """

    def __init__(self, request: Request, sent: float) -> None:
        self.request, self.sent, self.repeated = request, sent, False
        self.arrived: float | None = None
        self.payload = b""
        self._event = threading.Event()

    @property
    def here(self) -> bool:
        """Whether the answer has come."""
        return self._event.is_set()

    def fill(self, payload: bytes, now: float) -> None:
        """Called once, by the radio's thread."""
        self.payload, self.arrived = payload, now
        self._event.set()

    def wait(self, timeout: float) -> bool:
        """Block a worker thread for at most ``timeout`` seconds of wall time; whether the answer came."""
        return self._event.wait(timeout)


class Requests:
    """Requests of one drone.

    Args:
        crazyflie: cflib's object.
        now: the flight's clock.
        name: the drone, for error messages.
    """

    def __init__(self, crazyflie: Any, now: Callable[[], float], name: str) -> None:  # noqa: ANN401 - untyped library
        self._crazyflie, self._now, self._name = crazyflie, now, name
        self._pending: dict[tuple[int, int, bytes], list[Reply]] = {}
        self._lock = threading.Lock()
        for port in ANSWERING_PORTS:
            crazyflie.add_port_callback(port, self._incoming)

    def send(self, request: Request) -> Reply:
        """Send and return at once; poll the reply."""
        reply = Reply(request, self._now())
        with self._lock:
            self._pending.setdefault(request.key, []).append(reply)
        self.transmit(request.port, request.channel, request.payload)
        return reply

    def resend(self, reply: Reply) -> None:
        """Send the request of an unanswered reply again."""
        reply.sent, reply.repeated = self._now(), True
        self.transmit(reply.request.port, reply.request.channel, reply.request.payload)

    def ask(self, request: Request, *, timeout: float = 0.3, tries: int = 6) -> bytes:
        """Send, wait, repeat; for worker threads and harmless to repeat requests only.

        Args:
            request: what to ask.
            timeout: wall time to wait for each answer [s].
            tries: how often to send it.

        Raises:
            LinkError: no answer, or no link any more.
        """
        reply = self.send(request)
        for _ in range(tries - 1):
            if reply.wait(timeout) or self._crazyflie.link is None:
                break
            self.resend(reply)
        if reply.wait(timeout if self._crazyflie.link is not None else 0.0):
            return reply.payload
        self.forget(reply)
        if self._crazyflie.link is None:
            raise LinkError(f"{self._name}: {request.what}: the link is gone")
        raise LinkError(f"{self._name}: {request.what}: no answer to {tries} requests within {tries * timeout:.1f} s")

    def converse(self, conversation: Conversation[T]) -> T:
        """Carry a conversation on to its end; for worker threads. Raises LinkError, and what it raises itself."""
        try:
            request = next(conversation)
            while True:
                request = conversation.send(self.ask(request))
        except StopIteration as end:
            result: T = end.value
            return result

    def transmit(self, port: int, channel: int, payload: bytes) -> None:
        """Send one packet that nobody answers, or whose answer nobody waits for."""
        packet = CRTPPacket()
        packet.set_header(port, channel)
        packet.data = payload
        self._crazyflie.send_packet(packet)

    def forget(self, reply: Reply) -> None:
        """Wait no longer for an answer."""
        with self._lock:
            waiting = self._pending.get(reply.request.key, [])
            if reply in waiting:
                waiting.remove(reply)

    def _incoming(self, packet: Any) -> None:  # noqa: ANN401 - untyped library
        data = bytes(packet.data)
        filled: list[Reply] = []
        with self._lock:
            for key in [k for k in self._pending if k[:2] == (packet.port, packet.channel) and data.startswith(k[2])]:
                # One answer serves everybody who asked the same: a repeated request has only one outcome.
                filled += self._pending.pop(key)
        now = self._now()
        for reply in filled:
            reply.fill(data, now)
