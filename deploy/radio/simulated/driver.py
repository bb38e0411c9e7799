"""``sim://`` behind cflib's own driver seam: nothing above :class:`CRTPDriver` can tell it from a radio.

A driver only queues: packets are answered inside ``send_packet``, in the caller's thread, and cflib's receiver thread
picks the answers up. :class:`Traffic` counts what it has not digested yet, so that virtual time can wait for it.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Protocol, TypeAlias
from urllib.parse import unquote, urlsplit

import cflib.crtp
from cflib.crtp.crtpdriver import CRTPDriver
from cflib.crtp.crtpstack import CRTPPacket
from cflib.crtp.exceptions import WrongUriType

from deploy.errors import LinkError
from deploy.radio.simulated.air.line import Line
from deploy.radio.simulated.air.model import rate_limit_of
from deploy.radio.simulated.crazyflie import SimulatedCrazyflie

SCHEME = "sim"
REPORTING = 0.1  # [s] between reports on a link, as by the radio driver
_RSSI = 40.0  # [-dBm], what a radio across a room reports
_ECHO, _CFLIBS = 0xF0, b"\0"  # header (port 15, channel 0; reserved bits apart) and first byte of cflib's own pings

StatisticsCallback = Callable[[dict[str, float]], None]
ErrorCallback = Callable[[str], None]
Inbox: TypeAlias = "queue.SimpleQueue[CRTPPacket | None]"


class Traffic:
    """Packets that clients have been sent and not yet digested, over all drivers of a swarm.

    Attributes:
        lock: keeps the counts, also those of the drivers.
    """

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self._pending = 0
        self._calm = threading.Condition(self.lock)
        self._held: list[tuple[Inbox, CRTPPacket]] | None = None

    def add(self, inbox: Inbox, packet: CRTPPacket) -> None:
        """Queue a packet for a client. The caller holds the lock."""
        self._pending += 1
        if self._held is None:
            inbox.put(packet)
        else:
            self._held.append((inbox, packet))

    @contextmanager
    def hold(self) -> Iterator[None]:
        """Let clients have what they are sent in here only at the end.

        Their threads would wake up packet by packet and take the interpreter from the physics at every matrix product.
        """
        with self.lock:
            self._held = []
        try:
            yield
        finally:
            with self.lock:
                held, self._held = self._held, None
                for inbox, packet in held:
                    inbox.put(packet)

    def done(self, count: int) -> None:
        """Packets were digested: their callbacks returned, or nobody will ever call them. The caller holds the lock."""
        self._pending -= count
        if self._pending == 0:
            self._calm.notify_all()

    def settle(self, timeout: float) -> bool:
        """Wait until everything is digested; False after ``timeout`` seconds of wall time."""
        if self._pending == 0:  # reading an int is atomic; this path is taken on nearly every tick
            return True
        with self._calm:
            return self._calm.wait_for(lambda: self._pending == 0, timeout)


class Network(Protocol):
    """What a driver needs of the swarm that it connects to."""

    @property
    def drones(self) -> Mapping[str, SimulatedCrazyflie]:
        """The drones by name."""

    def uris(self) -> Mapping[str, str]:
        """URI by drone name."""

    def open(self, name: str, driver: SimulatedDriver) -> Traffic:
        """A client has connected to a drone; LinkError if somebody else is."""

    def line(self, name: str) -> Line | None:
        """A drone's link over a modelled radio; None over an ideal one."""

    def closed(self, name: str) -> None:
        """That client has gone."""


_networks: dict[str, Network] = {}
_networks_lock = threading.Lock()


class SimulatedDriver(CRTPDriver):  # type: ignore[misc]
    """cflib's link to one simulated drone: ``sim://<swarm>/<robot>``, like a radio's with ``?rate_limit=N`` after it.

    Over a modelled radio (:mod:`deploy.radio.simulated.air`) a packet is under way for a while, over an ideal one its
    answers are queued when ``send_packet`` returns.
    """

    def __init__(self) -> None:
        super().__init__()
        self.needs_resending = False
        self.uri = ""
        self._inbox: Inbox = queue.SimpleQueue()
        self._outstanding = 0  # queued, not digested
        self._taken = 0  # handed to cflib and not yet counted as digested
        self._closed = True
        self._sent = self._received = 0
        self._reported = (0.0, 0, 0)

    def connect(
        self,
        uri: str,
        radio_link_statistics_callback: StatisticsCallback | None,
        link_error_callback: ErrorCallback | None,
    ) -> None:
        """Connect. Raises WrongUriType for another scheme, LinkError for a drone that is not there or taken."""
        parts = urlsplit(uri)
        if parts.scheme != SCHEME:
            raise WrongUriType(f"not a simulated drone: {uri}")
        self.uri, name = uri, unquote(parts.path.lstrip("/"))
        with _networks_lock:
            network = _networks.get(parts.netloc)
        if network is None:
            raise LinkError(f"{uri}: no simulated swarm {parts.netloc!r} is running; running: {sorted(_networks)}")
        drone = network.drones.get(name)
        if drone is None:
            raise LinkError(f"{uri}: no drone {name!r} in this swarm; its drones: {sorted(network.drones)}")
        self._statistics, self._on_error = radio_link_statistics_callback, link_error_callback
        self._traffic = network.open(name, self)
        self._network, self._name, self._drone = network, name, drone
        self._line = network.line(name)
        self._closed = False
        if self._line is None:
            drone.attach(self._deliver)
        else:
            self._line.open(self._deliver, self.lose, rate_limit_of(parts.query))
            drone.attach(self._line.answer)

    def send_packet(self, pk: CRTPPacket) -> None:
        """Give the packet to the radio. Called by cflib's threads and the client's."""
        if self._closed:
            return
        self._sent += 1
        if self._line is None:
            self._drone.receive(pk.header, bytes(pk.data))
        elif pk.header & 0xF3 == _ECHO and pk.data[:1] == _CFLIBS:
            # cflib pings by wall time: on the modelled air that would make one flight differ from the next.
            if self._line.reachable:
                self._deliver(_ECHO >> 4, 0, bytes(pk.data))
        else:
            self._line.send(pk.header, bytes(pk.data))

    def receive_packet(self, wait: float = 0) -> CRTPPacket | None:
        """The next packet, or None after ``wait`` seconds (0: at once, below 0: never)."""
        if self._taken and self._inbox.empty():  # cflib has returned from the callbacks of all packets before
            self._digested()
        try:
            packet = self._inbox.get(block=wait != 0, timeout=wait if wait > 0 else None)
        except queue.Empty:
            return None
        if packet is not None:
            self._taken += 1
        return packet

    def close(self) -> None:
        """Hang up; may be called again. The None wakes cflib's receiver, which would sleep on for a second."""
        if self._closed:
            return
        with self._traffic.lock:
            if self._closed:
                return
            self._closed = True
            dropped, self._outstanding = self._outstanding, 0
            self._traffic.done(dropped)
        if self._line is not None:
            self._line.close()
        self._drone.attach(None)
        self._network.closed(self._name)
        self._inbox.put(None)

    def report_statistics(self, t: float, quality: float = 100.0, rssi: float = _RSSI) -> None:
        """Tell cflib about the link as the radio driver does, every :data:`REPORTING` seconds of simulated time.

        Args:
            t: simulated time [s].
            quality: share of attempts that succeed [%].
            rssi: signal strength [-dBm].
        """
        before, sent, received = self._reported
        self._reported = (t, self._sent, self._received)
        if self._statistics is not None and not self._closed:
            up, down = ((now - then) / (t - before) for now, then in ((self._sent, sent), (self._received, received)))
            self._statistics(
                {
                    "link_quality": quality,
                    "uplink_rssi": rssi,
                    "uplink_rate": up,
                    "downlink_rate": down,
                    "uplink_congestion": 0.0,
                    "downlink_congestion": 0.0,
                }
            )

    def lose(self, reason: str) -> None:
        """The drone has gone silent: report what a radio would."""
        if self._on_error is not None and not self._closed:
            self._on_error(reason)

    def get_status(self) -> str:
        """For cflib's interface list."""
        return "simulated"

    def get_name(self) -> str:
        """For cflib's interface list."""
        return SCHEME

    def scan_interface(self, address: object = None) -> list[list[str]]:
        """URIs of all drones of all running swarms."""
        with _networks_lock:
            return [[uri, ""] for network in _networks.values() for uri in network.uris().values()]

    def _deliver(self, port: int, channel: int, data: bytes) -> None:
        packet = CRTPPacket(port << 4 | channel, data)
        with self._traffic.lock:
            if self._closed:
                return
            self._outstanding += 1
            self._received += 1
            self._traffic.add(self._inbox, packet)

    def _digested(self) -> None:
        taken, self._taken = self._taken, 0
        with self._traffic.lock:
            if self._closed:
                return  # close() has already written these packets off
            self._outstanding -= taken
            self._traffic.done(taken)


def register() -> None:
    """Let cflib know about ``sim://`` (idempotent; independent of ``cflib.crtp.init_drivers``)."""
    if SimulatedDriver not in cflib.crtp.CLASSES:
        cflib.crtp.CLASSES.insert(0, SimulatedDriver)


def unregister() -> None:
    """Forget ``sim://``."""
    if SimulatedDriver in cflib.crtp.CLASSES:
        cflib.crtp.CLASSES.remove(SimulatedDriver)


def serve(label: str, network: Network) -> None:
    """Put a swarm on the air as ``sim://<label>/…``. Raises LinkError if the label is taken."""
    with _networks_lock:
        if label in _networks:
            raise LinkError(f"sim://{label} is already on the air; close that swarm or choose another label")
        _networks[label] = network


def withdraw(label: str) -> None:
    """Take a swarm off the air; may be called again."""
    with _networks_lock:
        _networks.pop(label, None)
