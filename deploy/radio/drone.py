"""One Crazyflie: what can be asked of it, and what it can be told; link in ``link.py``, telemetry in ``stream.py``.

Threads and callbacks stay inside these three. What blocks (connect, parameters, memory, close) is for worker threads
and has a deadline; what the flight loop calls (poll, send, pose, emergency stop) returns at once.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any, TypeVar

from cflib.crazyflie import Crazyflie

from deploy.clock import Clock
from deploy.errors import CommandRefused, LinkError
from deploy.radio import orders, parameters, telemetry
from deploy.radio.link import Link, LinkState
from deploy.radio.memory import MemoryInfo
from deploy.radio.ping import Pings
from deploy.radio.requests import Conversation, Reply, Request, Requests
from deploy.radio.stream import Stream
from deploy.radio.supervisor import Supervisor

T = TypeVar("T")
Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]
CONNECT_DEADLINE = 45.0  # s of wall time; an uncached table of contents over a busy radio takes a while
_SUPERVISOR = Request(9, 0, b"\x0c", b"\x8c", "supervisor state")
RECONNECT_DEADLINE = 10.0  # s of wall time; the tables are in the cache by then
_FIRMWARE = Request(0x0D, 1, b"\x01", b"\x01", "firmware version")


class Drone:
    """One Crazyflie on the other end of a link.

    Args:
        name: the robot's name. uri: cflib link URI.
        clock: the flight's clock; stamps everything that arrives.
        toc_cache: folder for the drone's tables of contents (they take most of a connection's time); None: no cache.
    """

    def __init__(self, name: str, uri: str, clock: Clock, toc_cache: Path | None = None) -> None:
        self.name, self.uri = name, uri
        self._crazyflie: Any = Crazyflie(rw_cache=None if toc_cache is None else str(toc_cache))
        self._requests = Requests(self._crazyflie, clock.now, name)
        self._pings = Pings(self._requests)
        self._link = Link(self._crazyflie, clock, self._pings)
        self._stream = Stream(self._crazyflie, clock, name)
        self._protocol = orders.UNKNOWN

    # ------------------------------------------------------------------------------------------------ connection

    def connect(self, deadline: float = CONNECT_DEADLINE) -> None:
        """Open the link and fetch the drone's tables; blocks for at most ``deadline`` seconds of wall time.

        Raises:
            LinkError: it did not come up.
        """
        try:
            self._link.open(self.uri, deadline)
        except LinkError as error:
            raise LinkError(f"{self.name} at {self.uri}: {error}") from None
        self._protocol = self.protocol  # as long as the link is there to tell it
        # A connection that was closed before leaves a low-level setpoint behind that outranks the high-level
        # commander: without this word every command is accepted and nothing moves.
        self.release_setpoints()

    def reconnect(self, rate: float, deadline: float = RECONNECT_DEADLINE) -> None:
        """Open a lost link again and have telemetry sent at ``rate`` [Hz]; blocks. The drone may be flying.

        Nothing is sent that a flying drone obeys.

        Raises:
            LinkError: it did not come up. CommandRefused: a log block was refused.
        """
        try:
            self._link.reopen(self.uri, deadline)
        except LinkError as error:
            raise LinkError(f"{self.name} at {self.uri}: {error}") from None
        self._stream.start(rate)

    def close(self, *, force: bool = False) -> None:
        """Close the link; refuses in flight, because cflib's farewell packet is a zero thrust setpoint: a fall.

        Args:
            force: close whatever the drone does (after an emergency stop, or when its link is lost anyway).

        Raises:
            CommandRefused: it flies, or does not say that it does not.
        """
        if self._link.up and not force and self.supervisor().flying:
            raise CommandRefused(f"{self.name}: closing the link in flight would drop the drone")
        self._link.close()

    @property
    def connected(self) -> bool:
        """Whether the link is up."""
        return self._link.up

    @property
    def link(self) -> LinkState:
        """Quality of the link as of now."""
        return self._link.state

    @property
    def heard(self) -> float:
        """Flight time of the last packet [s]; -inf before the first."""
        return self._link.heard

    @property
    def lost(self) -> str:
        """Why the link is gone; empty while it is up."""
        return self._link.lost

    @property
    def protocol(self) -> int:
        """CRTP protocol version; -1 before the drone has told it. Outlives the link: cflib forgets it with that."""
        told = int(self._crazyflie.platform.get_protocol_version())
        if told != orders.UNKNOWN:
            self._protocol = told
        return self._protocol

    def firmware(self) -> str:
        """Version of the firmware, as it calls itself; blocks."""
        answer = self._requests.ask(_FIRMWARE)
        return answer[1:].split(b"\0")[0].decode("ascii", "replace")

    # ------------------------------------------------------------------------------------------------ ground work

    def set_parameter(self, name: str, value: float, *, compare: bool = True) -> float:
        """Write an on-board parameter and read it back; blocks. Returns what the drone holds now.

        Args:
            name: ``group.name``.
            value: what it shall hold.
            compare: refuse if it holds something else; False for parameters the firmware changes itself.

        Raises:
            CommandRefused: unknown, read-only, does not fit, not held. LinkError: no answer.
        """
        return parameters.write(self._requests, self._parameter(name), value, compare=compare)

    def has_parameter(self, name: str) -> bool:
        """Whether the drone's table of parameters holds ``group.name``."""
        group, _, key = name.partition(".")
        return key in self._crazyflie.param.toc.toc.get(group, {})

    def read_parameter(self, name: str) -> float:
        """Ask the drone for a parameter; blocks. Raises like :meth:`set_parameter`."""
        return parameters.read(self._requests, self._parameter(name))

    def memory(self, kind: int) -> MemoryInfo:
        """The drone's first memory of a type.

        Raises:
            CommandRefused: it has none. LinkError: there is no link any more.
        """
        for element in self._crazyflie.mem.mems:
            if element.type == kind:
                return MemoryInfo(element.id, element.type, element.size)
        self._require_link()
        raise CommandRefused(f"{self.name}: it has no memory of type 0x{kind:02X}")

    def converse(self, conversation: Conversation[T]) -> T:
        """Carry a conversation on to its end; blocks. Raises LinkError, and what it raises itself."""
        return self._requests.converse(conversation)

    def supervisor(self) -> Supervisor:
        """Ask for the supervisor's state; blocks (older firmware: the newest telemetry). Raises LinkError."""
        if self.protocol >= 12:
            return Supervisor(struct.unpack_from("<H", self._requests.ask(_SUPERVISOR), 1)[0])
        if self.status is None:
            raise LinkError(f"{self.name}: no supervisor state yet")
        return self.status.supervisor

    # ------------------------------------------------------------------------------------------------ telemetry

    def start_telemetry(self, rate: float) -> None:
        """Have the drone log its state at ``rate`` [Hz] until the link ends; blocks until every block runs.

        Raises:
            CommandRefused: the drone lacks a variable or refuses a block. LinkError: no answer.
        """
        self._stream.start(rate)

    def stop_telemetry(self, name: str) -> None:
        """Spare the radio a log block that has served its purpose: a key of ``telemetry.BLOCKS``."""
        self._stream.pause(name)

    def resume_telemetry(self, name: str) -> None:
        """Have a stopped log block sent again."""
        self._stream.resume(name)

    def poll(self) -> tuple[telemetry.Record, ...]:
        """Telemetry that arrived since the last call, oldest first; also updates the newest records."""
        return self._stream.poll()

    @property
    def estimate(self) -> telemetry.Estimate | None:
        """Newest that :meth:`poll` returned; None before the first."""
        return self._stream.estimate

    @property
    def target(self) -> telemetry.Target | None:
        """Newest that :meth:`poll` returned; None before the first."""
        return self._stream.target

    @property
    def status(self) -> telemetry.Status | None:
        """Newest that :meth:`poll` returned; None before the first."""
        return self._stream.status

    @property
    def variance(self) -> telemetry.Variance | None:
        """Newest that :meth:`poll` returned; None before the first."""
        return self._stream.variance

    # ------------------------------------------------------------------------------------------------ flight loop

    def send(self, command: Request) -> Reply:
        """Give a command without waiting; the reply fills when the drone answers."""
        return self._requests.send(command)

    def resend(self, reply: Reply) -> None:
        """Give an unanswered command again."""
        self._requests.resend(reply)

    def send_parameter(self, name: str, value: float) -> Reply:
        """Write an on-board parameter without waiting; the reply fills when the drone has it.

        Raises:
            CommandRefused: unknown, read-only, does not fit. LinkError: there is no link any more.
        """
        return self._requests.send(parameters.writing(self._parameter(name), value))

    def forget(self, reply: Reply) -> None:
        """Wait no longer for an answer."""
        self._requests.forget(reply)

    def ping(self) -> None:
        """Measure the link; see ``ping.py``."""
        if self.connected:
            self._pings.ping()

    def request_supervisor(self) -> Reply:
        """Ask for the supervisor's state without waiting (protocol 12 and later)."""
        return self._requests.send(_SUPERVISOR)

    def send_pose(self, position: Vec3, quaternion: Quat | None) -> None:
        """Tell the drone where motion capture sees it: position [m], orientation x, y, z, w if known."""
        if not self.connected:
            return
        if quaternion is None:
            self._crazyflie.loc.send_extpos(position)
        else:
            self._crazyflie.loc.send_extpose(position, quaternion)

    def release_setpoints(self) -> None:
        """Hand control back from low-level setpoints to the high-level commander (B4 of the protocol notes)."""
        self._crazyflie.commander.send_notify_setpoint_stop()

    def request_arming(self, arm: bool) -> None:
        """Ask the supervisor to arm or disarm; watch the state for the outcome."""
        self._order(orders.arm(self.protocol, arm))

    def emergency_stop(self) -> None:
        """Stop the motors now: the drone falls, and is locked until it is restarted."""
        self._order(orders.emergency_stop(self.protocol))

    def feed_watchdog(self) -> None:
        """From the first call on, a second without another stops the motors for good; may block for two seconds."""
        if self.connected:
            self._order(orders.feed_watchdog(self.protocol))

    # ------------------------------------------------------------------------------------------------ inside

    def _order(self, packets: tuple[orders.Order, ...]) -> None:
        for packet in packets:
            self._requests.transmit(*packet)

    def _require_link(self) -> None:
        """For what cflib does not know of: it forgets a drone's tables with its link."""
        if not self._link.up:
            raise LinkError(f"{self.name}: {self._link.lost or 'the link is gone'}")

    def _parameter(self, name: str) -> parameters.Parameter:
        element = self._crazyflie.param.toc.get_element_by_complete_name(name) if name.count(".") == 1 else None
        if element is None:
            self._require_link()
            raise CommandRefused(f"{self.name}: it has no parameter '{name}'")
        return parameters.Parameter(name, element.ident, element.pytype, element.access == element.RO_ACCESS)
