"""A swarm on the air: firmware, world, clock and cflib's driver wired together."""

from __future__ import annotations

import sys
import threading
from collections.abc import Mapping, Sequence
from types import MappingProxyType, TracebackType
from typing import Protocol
from urllib.parse import quote

from deploy.clock import VirtualClock
from deploy.errors import LinkError
from deploy.radio.simulated.air.air import Air
from deploy.radio.simulated.air.line import LOST, Line
from deploy.radio.simulated.crazyflie import SimulatedCrazyflie
from deploy.radio.simulated.driver import REPORTING, SCHEME, SimulatedDriver, Traffic, register, serve, withdraw
from deploy.radio.simulated.interface import Firmware
from missions.airframes import Airframe

_TURN = 0.05  # [s] see _Turns
_BARE: Mapping[str, tuple[str, ...]] = MappingProxyType({})
_SILENCE = 0.5  # [s] of a rebooting drone's silence until the radio would give up on it


class World(Protocol):
    """What moves the drones; see :mod:`deploy.radio.simulated.physics`."""

    def attach(self, firmwares: Sequence[Firmware]) -> None:
        """The brains, in the order of the bodies."""

    def advance(self, t: float) -> None:
        """Move to world time ``t`` [s], ticking every firmware each 10 ms."""


class _Turns:
    """Longer turns for Python's threads while swarms fly in virtual time.

    At every tick the clock waits for cflib's threads anyway. In between they cannot help it, and taking the interpreter
    from it every 5 ms, Python's default, is what a sixth of a rehearsal's time would go to.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._users, self._usual = 0, 0.0

    def lengthen(self) -> None:
        """One more swarm flies."""
        with self._lock:
            if self._users == 0:
                self._usual = sys.getswitchinterval()
                sys.setswitchinterval(max(_TURN, self._usual))
            self._users += 1

    def restore(self) -> None:
        """One swarm less; after the last one turns are as they were."""
        with self._lock:
            self._users -= 1
            if self._users == 0:
                sys.setswitchinterval(self._usual)


_turns = _Turns()


class SimulatedSwarm:
    """Simulated drones at ``sim://<label>/<name>``, carried along by a clock.

    Use as a context manager, or call :meth:`close`.

    Args:
        names: drone names, in the world's order.
        world: moves the bodies.
        clock: carries the world along and waits for clients to digest; None when the caller drives the world itself.
        label: host part of the URIs.
        auto_arm, airframe: of every drone, see :class:`SimulatedCrazyflie`.
        decks: board names of what is plugged in, by drone; nothing into those that are not in it.
        air: the radio between them and their clients; None: an ideal one.

    Raises:
        LinkError: another swarm has that label.
    """

    def __init__(
        self,
        names: Sequence[str],
        world: World,
        clock: VirtualClock | None = None,
        *,
        label: str = "swarm",
        auto_arm: bool = True,
        airframe: Airframe | None = None,
        decks: Mapping[str, tuple[str, ...]] = _BARE,
        air: Air | None = None,
    ) -> None:
        if len(set(names)) != len(names):
            raise ValueError(f"drone names must be distinct; got {list(names)}")
        self._drones = {
            name: SimulatedCrazyflie(
                name, address=(i + 1) & 0xFF, auto_arm=auto_arm, airframe=airframe, decks=decks.get(name, ())
            )
            for i, name in enumerate(names)
        }
        self._label, self._world = label, world
        self._air = air
        if air is not None:
            air.attach(self._drones)
        self._traffic = Traffic()
        self._clients: dict[str, SimulatedDriver] = {}
        self._lock = threading.Lock()
        self._reboots = dict.fromkeys(names, 0)
        self._silent_since: dict[str, float] = {}
        self._reported = 0.0  # [s] when clients were told last how their links are
        world.attach(list(self._drones.values()))
        serve(label, self)
        register()
        self._has_clock = clock is not None
        if clock is not None:
            clock.attach(self.advance, self.settle, None if air is None else air.owed)
            _turns.lengthen()

    @property
    def drones(self) -> Mapping[str, SimulatedCrazyflie]:
        """The drones by name."""
        return MappingProxyType(self._drones)

    def uris(self) -> Mapping[str, str]:
        """URI by drone name."""
        return {name: f"{SCHEME}://{self._label}/{quote(name, safe='')}" for name in self._drones}

    def advance(self, t: float) -> None:
        """Move radio and world to ``t`` [s]; then report to cflib what a radio driver would."""
        with self._traffic.hold():
            if self._air is not None:
                self._air.advance(t)
            self._world.advance(t)
        if self._air is not None:
            self._air.hand_out(t)
        if t - self._reported >= REPORTING - 1e-9:
            self._reported = t
            self._report(t)
        if self._air is None:
            for name, client in self._clients_now():
                if self._has_gone_silent(name, t):
                    client.lose(LOST)

    def _report(self, t: float) -> None:
        """Tell all clients how their links are."""
        for name, client in self._clients_now():
            if self._air is None:
                client.report_statistics(t)
            else:
                client.report_statistics(t, self._air.lines[name].quality, self._air.rssi(name))

    def _clients_now(self) -> list[tuple[str, SimulatedDriver]]:
        with self._lock:
            return list(self._clients.items())

    def settle(self, timeout: float) -> bool:
        """Wait until all clients have digested what they were sent; False after ``timeout`` [s] of wall time."""
        return self._traffic.settle(timeout)

    def open(self, name: str, driver: SimulatedDriver) -> Traffic:
        """A driver connects to a drone. Raises LinkError if the drone has a client."""
        with self._lock:
            if name in self._clients:
                raise LinkError(f"{self.uris()[name]} already has a client; one connection a drone")
            self._clients[name] = driver
        return self._traffic

    def line(self, name: str) -> Line | None:
        """A drone's link over the modelled radio; None over an ideal one."""
        return None if self._air is None else self._air.lines[name]

    def hang_up(self, reason: str) -> None:
        """All clients lose their links at once."""
        with self._lock:
            clients = list(self._clients.values())
        for client in clients:
            client.lose(reason)

    def closed(self, name: str) -> None:
        """A driver has hung up."""
        with self._lock:
            self._clients.pop(name, None)

    def close(self) -> None:
        """Take the swarm off the air and hang up on its clients; may be called again."""
        withdraw(self._label)
        if self._has_clock:
            self._has_clock = False
            _turns.restore()
        with self._lock:
            clients = list(self._clients.values())
        for client in clients:
            client.close()

    def __enter__(self) -> SimulatedSwarm:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _has_gone_silent(self, name: str, t: float) -> bool:
        """Whether a reboot has just made the drone silent for longer than a radio puts up with."""
        drone = self._drones[name]
        if drone.reboots != self._reboots[name]:
            self._reboots[name] = drone.reboots
            self._silent_since[name] = t
        since = self._silent_since.get(name)
        if since is None or t - since < _SILENCE:
            return False
        del self._silent_since[name]
        return True
