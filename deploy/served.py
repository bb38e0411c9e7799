"""A mission's drones on UDP ports in real time, for clients that know nothing of this project."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

from deploy.clock import Clock
from deploy.radio.simulated.interface import Vec3
from deploy.radio.simulated.positioning import MocapRelay, OnboardPositioning
from deploy.radio.simulated.server import FIRST_PORT, UdpServer
from deploy.radio.supervisor import Supervisor
from deploy.rehearsal import Stage
from missions.decks import DeckName
from missions.schema import Mission

TICK = 0.01  # [s] of the firmware
_LATEST = 0.2  # [s] of delay that is caught up with; what is more is lost, or a slow computer would never come back
STATUS = 0.25  # [s] between two looks of an observer

Positioning = Literal["onboard", "mocap", "none"]
POSITIONING: tuple[Positioning, ...] = ("onboard", "mocap", "none")


class DroneStatus(NamedTuple):
    """One drone as somebody in the room sees it.

    Attributes:
        name, uri: who, and where it is served.
        connected: whether a client has talked to it within a second.
        state: of the supervisor, in words.
        voltage: of the battery [V].
        position: true position [m].
    """

    name: str
    uri: str
    connected: bool
    state: str
    voltage: float
    position: Vec3


class Served:
    """A mission's drones at ``udp://<host>:<port>``, ``<port + 1>``, …, standing on their pads.

    A context manager.

    Args:
        mission: whose robots to serve.
        clock: real time.
        host, port: see :class:`UdpServer`.
        positioning: where the estimators get the position from: a deck on board, motion capture that sends every
            drone its pose, or nowhere (then it is the clients' business).
        seed: of everything random.

    Attributes:
        lost: [s] by which the drones' time has fallen behind the clock for good.

    Raises:
        LinkError: a port cannot be had.
    """

    def __init__(
        self,
        mission: Mission,
        clock: Clock,
        *,
        host: str = "127.0.0.1",
        port: int = FIRST_PORT,
        positioning: Positioning = "onboard",
        seed: int = 0,
    ) -> None:
        self._clock = clock
        decks: tuple[DeckName, ...] = ("lighthouse4",) if positioning == "onboard" else ()
        self._stage = Stage(mission, seed=seed, label=f"served-{id(self)}", decks=decks)
        drones = self._stage.swarm.drones
        self.lost = 0.0
        self._relay: MocapRelay | None = None
        if positioning == "onboard":
            OnboardPositioning(self._stage.world, list(drones.values()), seed)
        elif positioning == "mocap":
            bodies = [(robot.rigid_body or robot.name, drones[robot.name]) for robot in mission.robots]
            self._relay = MocapRelay(self._stage.mocap, bodies)
        try:
            self._server = UdpServer(drones, host, port)
        except BaseException:
            self._stage.__exit__()
            raise
        self.uris = self._server.uris

    def run(
        self, stop: Callable[[], bool], observe: Callable[[Served], None] | None = None, period: float = STATUS
    ) -> None:
        """Serve until ``stop()``; ``observe`` is called every ``period`` [s]. Late ticks are caught up with."""
        clock, world = self._clock, self._stage.clock
        start = clock.now() - world.now()
        look = clock.now()
        while not stop():
            now = clock.now()
            late = now - start - world.now()
            if late > _LATEST:
                start += late - _LATEST
                self.lost += late - _LATEST
            if late >= TICK:
                if self._relay is not None:
                    self._relay.send()
                world.sleep_until(world.now() + TICK)
            self._server.exchange(now, max(0.0, TICK - late))
            if observe is not None and now >= look:
                look = now + period
                observe(self)

    @property
    def t(self) -> float:
        """The drones' time [s]."""
        return self._stage.clock.now()

    def status(self) -> list[DroneStatus]:
        """Everybody, in the mission's order."""
        world = self._stage.world
        rows = zip(self._stage.swarm.drones.items(), world.positions.tolist(), world.batteries.voltage, strict=True)
        return [
            DroneStatus(
                name,
                self.uris[name],
                self._server.has_client(name),
                _words(Supervisor(drone.info)) if drone.is_alive else "rebooting",
                float(voltage),
                (x, y, z),
            )
            for (name, drone), (x, y, z), voltage in rows
        ]

    def close(self) -> None:
        """Take everybody off the air; may be called again."""
        self._server.close()
        self._stage.__exit__()

    def __enter__(self) -> Served:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _words(supervisor: Supervisor) -> str:
    """What a supervisor is up to."""
    if supervisor.fault:
        return supervisor.fault
    if supervisor.flying:
        return "flying"
    if supervisor.ready:
        return "ready"
    return "armed" if supervisor.armed else "not armed"
