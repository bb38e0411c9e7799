"""One Crazyflie: the only importer of cflib.crazyflie.

Threads and callbacks stay inside. What blocks (connect, parameters, memory, close) is for worker threads and has a
deadline; what the flight loop calls (poll, send, pose, emergency stop) returns at once.
"""

from __future__ import annotations

import math
import struct
import threading
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from cflib.crazyflie import Crazyflie
from cflib.crazyflie.log import LogConfig

from deploy.clock import Clock
from deploy.errors import CommandRefused, LinkError
from deploy.radio import parameters, telemetry
from deploy.radio.links import NO_DONGLE
from deploy.radio.memory import MemoryInfo
from deploy.radio.ping import Pings, is_foreign
from deploy.radio.requests import Conversation, Reply, Request, Requests
from deploy.radio.supervisor import Supervisor

T = TypeVar("T")
Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]
CONNECT_DEADLINE = 45.0  # s of wall time; an uncached table of contents over a busy radio takes a while
_LOG_DEADLINE = 3.0
_SUPERVISOR = Request(9, 0, b"\x0c", b"\x8c", "supervisor state")
_FIRMWARE = Request(0x0D, 1, b"\x01", b"\x01", "firmware version")


@dataclass(frozen=True)
class LinkState:
    """Quality of one link.

    Attributes:
        latency: longest of the last round trips [ms]; NaN before the first answer.
        quality: share of packets acknowledged [%]; NaN if the driver does not say. rssi: [dBm], NaN likewise.
        sent, received: packets so far. unanswered: pings that were lost.
        heard: flight time of the last packet [s]; -inf before the first.
        lost: why the link is gone; empty while it is up.
    """

    latency: float = math.nan
    quality: float = math.nan
    rssi: float = math.nan
    sent: int = 0
    received: int = 0
    unanswered: int = 0
    heard: float = -math.inf
    lost: str = ""


class Drone:
    """One Crazyflie on the other end of a link.

    Args:
        name: the robot's name. uri: cflib link URI.
        clock: the flight's clock; stamps everything that arrives.
        toc_cache: folder for the drone's tables of contents (they take most of a connection's time); None: no cache.

    Attributes:
        estimate, target, status, variance: newest telemetry that :meth:`poll` returned; None before the first.
    """

    def __init__(self, name: str, uri: str, clock: Clock, toc_cache: Path | None = None) -> None:
        self.name, self.uri, self._clock = name, uri, clock
        self._crazyflie: Any = Crazyflie(rw_cache=None if toc_cache is None else str(toc_cache))
        self._requests = Requests(self._crazyflie, clock.now, name)
        self._samples: deque[telemetry.Sample] = deque()
        self._ready = threading.Event()  # connected for good, or failed
        self._connected = False
        self._failure = self._lost = ""
        self._pings = Pings(self._requests)
        self._statistics = {"quality": math.nan, "rssi": math.nan}
        self._sent = self._received = 0
        self._heard = -math.inf
        self._tick = 0
        self._blocks: dict[str, Any] = {}
        self.estimate: telemetry.Estimate | None = None
        self.target: telemetry.Target | None = None
        self.status: telemetry.Status | None = None
        self.variance: telemetry.Variance | None = None
        self._listen()

    # ------------------------------------------------------------------------------------------------ connection

    def connect(self, deadline: float = CONNECT_DEADLINE) -> None:
        """Open the link and fetch the drone's tables; blocks for at most ``deadline`` seconds of wall time.

        Raises:
            LinkError: it did not come up.
        """
        self._failure = self._lost = ""
        self._ready.clear()
        self._crazyflie.open_link(self.uri)
        if not self._ready.wait(deadline):
            self._failure = f"not fully connected within {deadline:.0f} s (is the drone on, and at this address?)"
        if self._failure:
            self._crazyflie.close_link()
            raise LinkError(f"{self.name} at {self.uri}: {self._failure}")
        self._connected = True
        # Ten pings a second and drone are a fifth of a dongle's packets for ten drones; ours, twice a second, will do.
        self._crazyflie.link_statistics.latency.stop()
        # A connection that was closed before leaves a low-level setpoint behind that outranks the high-level
        # commander: without this word every command is accepted and nothing moves.
        self.release_setpoints()

    def close(self, *, force: bool = False) -> None:
        """Close the link; refuses in flight, because cflib's farewell packet is a zero thrust setpoint: a fall.

        Args:
            force: close whatever the drone does (after an emergency stop, or when its link is lost anyway).

        Raises:
            CommandRefused: it flies, or does not say that it does not.
        """
        if self._connected and not (force or self._lost) and self.supervisor().flying:
            raise CommandRefused(f"{self.name}: closing the link in flight would drop the drone")
        was_open = self._connected or self._crazyflie.link is not None
        self._connected = False
        self._failure = self._failure or "closed"  # whoever still waits for the connection need not
        self._ready.set()
        if was_open:
            self._crazyflie.close_link()

    @property
    def connected(self) -> bool:
        """Whether the link is up."""
        return self._connected and not self._lost

    @property
    def link(self) -> LinkState:
        """Quality of the link as of now."""
        return LinkState(
            self._pings.latency,
            **self._statistics,
            sent=self._sent,
            received=self._received,
            unanswered=self._pings.lost,
            heard=self._heard,
            lost=self._lost,
        )

    @property
    def heard(self) -> float:
        """Flight time of the last packet [s]; -inf before the first."""
        return self._heard

    @property
    def lost(self) -> str:
        """Why the link is gone; empty while it is up."""
        return self._lost

    @property
    def protocol(self) -> int:
        """CRTP protocol version."""
        return int(self._crazyflie.platform.get_protocol_version())

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
            CommandRefused: it has none.
        """
        for element in self._crazyflie.mem.mems:
            if element.type == kind:
                return MemoryInfo(element.id, element.type, element.size)
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

    def start_telemetry(self, rate: float) -> None:
        """Have the drone log its state at ``rate`` [Hz] until the link ends; blocks until every block runs.

        Raises:
            CommandRefused: the drone lacks a variable or refuses a block. LinkError: no answer.
        """
        period = min(2540, max(10, round(1000.0 / rate / 10.0) * 10))
        for name, variables in telemetry.BLOCKS.items():
            self._blocks[name] = block = self._log_block(name, variables, period)
            waited = time.monotonic() + _LOG_DEADLINE
            started = threading.Event()
            block.started_cb.add_callback(lambda _, on, event=started: event.set() if on else None)
            block.error_cb.add_callback(lambda _, message, event=started: event.set())
            block.start()
            if not started.wait(waited - time.monotonic()):
                raise LinkError(f"{self.name}: log block '{name}': no answer within {_LOG_DEADLINE:.0f} s")
            if not block.started:
                raise CommandRefused(f"{self.name}: log block '{name}': refused with error {block.err_no}")

    # ------------------------------------------------------------------------------------------------ flight loop

    def stop_telemetry(self, name: str) -> None:
        """Spare the radio a log block that has served its purpose: a key of ``telemetry.BLOCKS``."""
        self._blocks[name].stop()

    def resume_telemetry(self, name: str) -> None:
        """Have a stopped log block sent again."""
        self._blocks[name].start()

    def poll(self) -> tuple[telemetry.Record, ...]:
        """Telemetry that arrived since the last call, oldest first; also updates the attributes."""
        if not self._samples:
            return ()
        records = []
        while self._samples:
            record = telemetry.to_record(self._samples.popleft())
            if isinstance(record, telemetry.Estimate):
                self.estimate = record
            elif isinstance(record, telemetry.Target):
                self.target = record
            elif isinstance(record, telemetry.Status):
                self.status = record
            else:
                self.variance = record
            records.append(record)
        return tuple(records)

    def send(self, command: Request) -> Reply:
        """Give a command without waiting; the reply fills when the drone answers."""
        return self._requests.send(command)

    def resend(self, reply: Reply) -> None:
        """Give an unanswered command again."""
        self._requests.resend(reply)

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
        self._crazyflie.supervisor.send_arming_request(arm)

    def emergency_stop(self) -> None:
        """Stop the motors now: the drone falls, and is locked until it is restarted."""
        self._crazyflie.supervisor.send_emergency_stop()

    def feed_watchdog(self) -> None:
        """From the first call on, a second without another stops the motors for good; may block for two seconds."""
        if self.connected:
            self._crazyflie.supervisor.send_emergency_stop_watchdog()

    # ------------------------------------------------------------------------------------------------ inside

    def _listen(self) -> None:
        crazyflie = self._crazyflie
        crazyflie.fully_connected.add_callback(lambda uri: self._ready.set())
        crazyflie.connection_failed.add_callback(lambda uri, message: self._fail(message))
        crazyflie.connection_lost.add_callback(lambda uri, message: self._lose(message))
        crazyflie.packet_sent.add_callback(self._count_sent)
        crazyflie.packet_received.add_callback(self._count_received)
        statistics = crazyflie.link_statistics
        for caller, key in (
            (statistics.link_quality_updated, "quality"),
            (statistics.uplink_rssi_updated, "rssi"),
        ):
            caller.add_callback(lambda value, key=key: self._statistics.__setitem__(key, float(value)))

    def _fail(self, message: str) -> None:
        # cflib appends a traceback to what went wrong; the first line is for people.
        first = message.split("\n")[0].removeprefix("Couldn't load link driver: ")
        self._failure = NO_DONGLE if "Cannot find a Crazyradio" in first else first
        self._ready.set()

    def _lose(self, message: str) -> None:
        self._lost = message.split("\n")[0] or "the link broke"
        self._failure = self._failure or self._lost
        self._ready.set()

    # cflib pings by wall time. Counting its packets would make a rehearsal's log, and the moment at which a silent
    # drone is missed, those of the computer; telemetry and our own pings say as much.
    def _count_sent(self, packet: Any) -> None:  # noqa: ANN401 - untyped library
        self._sent += not is_foreign(packet)

    def _count_received(self, packet: Any) -> None:  # noqa: ANN401 - untyped library
        if not is_foreign(packet):
            self._received += 1
            self._heard = self._clock.now()

    def _parameter(self, name: str) -> parameters.Parameter:
        element = self._crazyflie.param.toc.get_element_by_complete_name(name) if name.count(".") == 1 else None
        if element is None:
            raise CommandRefused(f"{self.name}: it has no parameter '{name}'")
        return parameters.Parameter(name, element.ident, element.pytype, element.access == element.RO_ACCESS)

    def _log_block(self, name: str, variables: tuple[tuple[str, str], ...], period: int) -> Any:  # noqa: ANN401
        block = LogConfig(name, period)
        for variable, kind in variables:
            block.add_variable(variable, kind or None)
        try:
            self._crazyflie.log.add_config(block)
        except (KeyError, AttributeError) as error:
            raise CommandRefused(f"{self.name}: log block '{name}': {error.args[0]}") from error
        block.data_received_cb.add_callback(self._logged)
        return block

    def _logged(self, tick: int, values: Mapping[str, float], block: Any) -> None:  # noqa: ANN401 - untyped library
        self._tick = telemetry.unwrap(tick, self._tick)
        self._samples.append(telemetry.Sample(block.name, self._clock.now(), self._tick, values))
