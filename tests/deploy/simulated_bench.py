"""A simulated drone on a bench: packets in, packets out, time by hand. For tests of the firmware."""

from __future__ import annotations

from deploy.radio.simulated.crazyflie import SimulatedCrazyflie
from tests.deploy.ideal_world import TICK, IdealWorld


class Bench:
    """One drone in an ideal world, without cflib.

    Args:
        phase: seconds of world time before the first packet (the supervisor steps every 40 ms).
    """

    def __init__(self, *, phase: float = 0.0, **options) -> None:
        options.setdefault("hardware", False)
        self.drone = SimulatedCrazyflie("cf", address=7, **options)
        self.world = IdealWorld([(0.0, 0.0, 0.0)])
        self.world.attach([self.drone])
        self.body = self.world.bodies[0]
        self.received: list[tuple[int, int, bytes]] = []
        self.drone.attach(lambda port, channel, data: self.received.append((port, channel, bytes(data))))
        self.t = 0.0
        self.advance(phase)

    def advance(self, seconds: float) -> None:
        self.t += seconds
        self.world.advance(self.t)

    def send(self, port: int, channel: int, data: bytes) -> None:
        self.drone.receive(port << 4 | channel, data)

    def ask(self, port: int, channel: int, data: bytes) -> list[bytes]:
        """Answers on the same port and channel that come at once."""
        self.received.clear()
        self.send(port, channel, data)
        return [data for p, c, data in self.received if (p, c) == (port, channel)]

    def info(self) -> int:
        return int.from_bytes(self.ask(9, 0, b"\x0c")[0][1:], "little")

    def wait_for_info(self, info: int, patience: float) -> bool:
        """Advance tick by tick until the bit field is ``info``."""
        for _ in range(round(patience / TICK) + 1):
            if self.drone.info == info:
                return True
            self.advance(TICK)
        return False
