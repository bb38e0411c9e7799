"""Port 9, supervisor: state bits, arming, recovery, emergency stop (protocol 12; firmware crtp_supervisor.c)."""

from __future__ import annotations

import struct
from collections.abc import Callable

from deploy.radio.simulated.ports import Send
from deploy.radio.simulated.supervisor import Supervisor

PORT = 9
_INFO, _COMMAND = 0, 1
_ALL_BITS, _ANSWER = 0x0C, 0x80
_ARM, _RECOVER, _EMERGENCY_STOP, _FEED_WATCHDOG = 1, 2, 3, 4


class SupervisorPort:
    """Questions on channel 0, commands on channel 1.

    Args:
        send: where answers go.
        supervisor: who is asked.
        now: seconds since boot.
    """

    def __init__(self, send: Send, supervisor: Supervisor, now: Callable[[], float]) -> None:
        self._send, self._supervisor, self._now = send, supervisor, now

    def receive(self, channel: int, data: bytes) -> None:
        """Answer a question or carry out a command; the emergency ones are not answered."""
        if not data:
            return
        if channel == _INFO:
            self._answer(data[0])
        elif channel == _COMMAND:
            self._command(data)

    def _answer(self, question: int) -> None:
        info = self._supervisor.info
        if question == _ALL_BITS:
            self._send(PORT, _INFO, struct.pack("<BH", _ANSWER | question, info))
        elif 0 < question < _ALL_BITS:
            self._send(PORT, _INFO, bytes([_ANSWER | question, info >> (question - 1) & 1]))

    def _command(self, data: bytes) -> None:
        supervisor = self._supervisor
        if data[0] == _ARM:
            granted = supervisor.request_arming(bool(data[1:2].strip(b"\0")))
            self._send(PORT, _COMMAND, bytes([_ANSWER | _ARM, granted, supervisor.armed]))
        elif data[0] == _RECOVER:
            granted = supervisor.request_recovery()
            self._send(PORT, _COMMAND, bytes([_ANSWER | _RECOVER, granted, not supervisor.is_crashed]))
        elif data[0] == _EMERGENCY_STOP:
            supervisor.emergency_stop()
        elif data[0] == _FEED_WATCHDOG:
            supervisor.feed_watchdog(self._now())
