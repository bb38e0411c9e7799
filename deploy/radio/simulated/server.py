"""Simulated drones on UDP ports, as cflib's ``udp://`` driver and any other CRTP client expects them.

One datagram is one packet: header byte, then up to 30 bytes; there is no handshake and no end. A single ``FF`` asks
whether somebody is there and is answered in kind. Answers go to whoever spoke last, as a radio's acknowledgements do:
the next client takes over with its first packet, be the one before closed, killed or asleep. A client that says
nothing for :data:`SILENCE` counts as gone. There is no radio in between: nothing is lost but what the operating
system drops.
"""

from __future__ import annotations

import contextlib
import selectors
import socket
from collections.abc import Mapping
from types import MappingProxyType, TracebackType

from deploy.errors import LinkError
from deploy.radio.simulated.crazyflie import SimulatedCrazyflie

FIRST_PORT = 19850  # cflib's scan asks this one and the nine behind it
SILENCE = 1.0  # [s] without a packet after which a client is gone (firmware CONFIG_RADIO_ACTIVITY_TIMEOUT_MS)
_NULL = b"\xff"  # null packet: cflib's probe
_LONGEST = 31  # header and 30 bytes
_BATCH = 64  # datagrams of one drone at a time: a client that floods must not stop the clock

Address = tuple[str, int]


class _Station:
    """One drone on one port."""

    def __init__(self, drone: SimulatedCrazyflie, host: str, port: int) -> None:
        self.drone = drone
        self.client: Address | None = None
        self.heard = 0.0
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self.socket.setblocking(False)
            self.socket.bind((host, port))
        except BaseException:
            self.socket.close()
            raise

    def receive(self, now: float) -> None:
        """Hand what has arrived to the drone, in order."""
        for _ in range(_BATCH):
            try:
                datagram, sender = self.socket.recvfrom(2048)
            except BlockingIOError:
                return
            except ConnectionError:  # Windows reports here that an earlier answer found nobody
                continue
            self._handle(datagram, sender, now)

    def expire(self, now: float) -> None:
        """Forget a client that has gone silent."""
        if self.client is not None and now - self.heard > SILENCE:
            self.close_client()

    def close_client(self) -> None:
        """Forget the client; the drone goes on."""
        self.client = None
        self.drone.attach(None)

    def _handle(self, datagram: bytes, sender: Address, now: float) -> None:
        if datagram == _NULL:
            if self.drone.is_alive:
                self._send_to(sender, _NULL)
            if sender == self.client:
                self.heard = now
        elif 0 < len(datagram) <= _LONGEST:
            self.heard = now
            if sender != self.client:
                self.client = sender
                self.drone.attach(self._answer)
            self.drone.receive(datagram[0], datagram[1:])

    def _answer(self, port: int, channel: int, data: bytes) -> None:
        if self.client is not None:
            self._send_to(self.client, bytes([port << 4 | channel]) + data)

    def _send_to(self, address: Address, datagram: bytes) -> None:
        # A full buffer, a client that is no more: on the air, too, the packet would be gone.
        with contextlib.suppress(OSError):
            self.socket.sendto(datagram, address)


class UdpServer:
    """Drones at ``udp://<host>:<port>``, ``<port + 1>``, … Use as a context manager, or call :meth:`close`.

    One thread: nothing is heard or answered outside :meth:`exchange` but what the drones send on their own ticks.

    Args:
        drones: by name, in the order of their ports.
        host: interface to listen on; anybody who reaches it can fly the drones.
        port: of the first drone; 0 lets the operating system choose for each.

    Raises:
        LinkError: a port is in use, not allowed or beyond 65535, or the host is not one of this computer.
    """

    def __init__(
        self, drones: Mapping[str, SimulatedCrazyflie], host: str = "127.0.0.1", port: int = FIRST_PORT
    ) -> None:
        self._stations: dict[str, _Station] = {}
        self._selector = selectors.DefaultSelector()
        try:
            for i, (name, drone) in enumerate(drones.items()):
                self._open(name, drone, host, port + i if port else 0)
        except LinkError:
            self.close()
            raise

    @property
    def uris(self) -> Mapping[str, str]:
        """URI by drone name."""
        addresses = {name: station.socket.getsockname() for name, station in self._stations.items()}
        return MappingProxyType({name: f"udp://{host}:{port}" for name, (host, port) in addresses.items()})

    def has_client(self, name: str) -> bool:
        """Whether somebody has talked to the drone lately."""
        return self._stations[name].client is not None

    def exchange(self, now: float, timeout: float) -> None:
        """Wait up to ``timeout`` [s] for packets and let the drones answer; ``now`` [s] is any steady clock's."""
        for key, _ in self._selector.select(timeout):
            key.data.receive(now)
        for station in self._stations.values():
            station.expire(now)

    def close(self) -> None:
        """Hang up on everybody; may be called again."""
        for station in self._stations.values():
            station.close_client()
            self._selector.unregister(station.socket)
            station.socket.close()
        self._stations.clear()
        self._selector.close()

    def __enter__(self) -> UdpServer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _open(self, name: str, drone: SimulatedCrazyflie, host: str, port: int) -> None:
        where = f"udp://{host}:{port} for {name}"
        try:
            station = _Station(drone, host, port)
        except OverflowError:
            raise LinkError(f"{where}: ports end at 65535") from None
        except OSError as error:
            raise LinkError(f"{where}: {error.strerror or error}; choose another port or host") from None
        self._stations[name] = station
        self._selector.register(station.socket, selectors.EVENT_READ, station)
