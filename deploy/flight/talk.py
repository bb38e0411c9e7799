"""A conversation with a drone while everybody flies: a packet at a time, repeated if need be, and never waiting."""

from __future__ import annotations

from deploy.errors import LinkError
from deploy.flight.loop import RETRY
from deploy.radio.drone import Drone
from deploy.radio.requests import Conversation, Reply, Request

_TRIES = 6  # how often an unanswered packet of an upload is sent


class Talk:
    """A conversation with one drone, carried on from the flight loop.

    Attributes:
        over: whether it has come to its end. packets: requests sent so far.
    """

    def __init__(self, drone: Drone, conversation: Conversation[None]) -> None:
        self._drone, self._conversation = drone, conversation
        self._reply: Reply | None = None
        self._tries = self.packets = 0
        self.over = False

    def step(self, now: float) -> bool:
        """Send the next packet if there is one to send; whether one was sent.

        Raises:
            LinkError: no answer to any copy of a packet. Whatever the conversation raises.
        """
        if self._reply is None:
            return self._say(next(self._conversation))
        if self._reply.here:
            try:
                return self._say(self._conversation.send(self._reply.payload))
            except StopIteration:
                self.over = True
                return False
        if now - self._reply.sent < RETRY - 1e-9:
            return False
        if self._tries == _TRIES:
            self.end()
            raise LinkError(f"{self._drone.name}: {self._reply.request.what}: no answer to {_TRIES} requests")
        self._tries += 1
        self._drone.resend(self._reply)
        return True

    def end(self) -> None:
        """Wait for no answer any more."""
        if self._reply is not None:
            self._drone.forget(self._reply)

    def _say(self, request: Request) -> bool:
        self._reply, self._tries = self._drone.send(request), 1
        self.packets += 1
        return True
