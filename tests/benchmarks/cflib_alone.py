"""What cflib itself leaves free: as many poses sent and log packets received as in a flight, and nothing else.

Drones connect and start their telemetry as ever; then nobody simulates anything. What they said last they say again, at
the flight's rate, straight into cflib's own receiver threads; poses go out through cflib's own sender and are dropped.
No rehearsal of so many drones can be faster, whatever the simulation costs.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from deploy.clock import VirtualClock
from deploy.radio.drone import Drone
from deploy.radio.fleet import Fleet
from deploy.radio.simulated.swarm import SimulatedSwarm
from missions.radio import pose_rates
from missions.schema import Mission
from tests.deploy.ideal_world import TICK, IdealWorld

_SIMULATED = 10.0  # s
_LEVEL = (0.0, 0.0, 0.0, 1.0)


def cost(mission: Mission, tables: Path) -> float:
    """CPU seconds of one second of flight.

    Args:
        mission: says who flies, and how often poses and telemetry are sent.
        tables: folder for drones' tables of contents.
    """
    names = [robot.name for robot in mission.robots]
    clock, flight = VirtualClock(), mission.flight
    with SimulatedSwarm(names, IdealWorld([(0.0, 0.0, 0.0)] * len(names)), clock, label="cflib-alone") as swarm:
        fleet = Fleet([Drone(name, uri, clock, tables) for name, uri in swarm.uris().items()], clock)

        def tick() -> None:
            clock.sleep_until(clock.now() + TICK)

        fleet.each("connecting", Drone.connect, tick)
        fleet.each("starting telemetry", lambda drone: drone.start_telemetry(flight.log_rate), tick)
        for drone in fleet.values():
            drone.stop_telemetry("variance")  # as in flight
        said = _listen(swarm, clock, 2.0 / flight.log_rate)
        tick()
        poses = round(1.0 / (TICK * min(pose_rates(mission).values())))
        spent = _converse(swarm, list(fleet.values()), said, poses, round(1.0 / (TICK * flight.log_rate)))
        for drone in fleet.values():
            drone.close(force=True)
    return spent / _SIMULATED


def _listen(swarm: SimulatedSwarm, clock: VirtualClock, seconds: float) -> dict[str, list[tuple[int, int, bytes]]]:
    """One log packet of every block, by drone."""
    said: dict[str, dict[int, tuple[int, int, bytes]]] = {name: {} for name in swarm.drones}
    receivers = {name: drone._receiver for name, drone in swarm.drones.items()}
    for name, drone in swarm.drones.items():

        def hear(port: int, channel: int, data: bytes, heard: dict[int, tuple[int, int, bytes]] = said[name]) -> None:
            if (port, channel) == (5, 2):
                heard[data[0]] = port, channel, data

        drone.attach(hear)
    clock.sleep_until(clock.now() + seconds)
    for name, drone in swarm.drones.items():
        drone.attach(receivers[name])
    return {name: list(blocks.values()) for name, blocks in said.items()}


def _converse(
    swarm: SimulatedSwarm,
    drones: Sequence[Drone],
    said: dict[str, list[tuple[int, int, bytes]]],
    poses: int,
    logs: int,
) -> float:
    """CPU seconds of the conversation alone; a pose every so many ticks, and a packet of every block."""
    receivers = {name: drone._receiver for name, drone in swarm.drones.items()}
    for drone in swarm.drones.values():
        drone._ports = {}  # whatever it is sent, it drops
    start = time.process_time()
    for turn in range(round(_SIMULATED / TICK)):
        for drone in drones if turn % poses == 0 else ():
            drone.send_pose((1.0, 2.0, 0.5), _LEVEL)
        with swarm._traffic.hold():
            for name, receiver in receivers.items():
                # One exchange of the radio carries one packet back, so that blocks come one after the other.
                if turn % logs < len(said[name]) and receiver is not None:
                    receiver(*said[name][turn % logs])
        swarm.settle(10.0)
        for drone in drones:
            drone.poll()
    return time.process_time() - start
