"""A flight on simulated drones: the same ``fly``, other URIs, another pose source, another clock."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

import deploy.radio.simulated
from deploy.clock import VirtualClock
from deploy.execute import fly
from deploy.flight.records import FlightOutcome, FlightStatus
from deploy.flightlog.writer import FlightLog
from deploy.operator import Operator
from deploy.planfile import plan_bytes
from deploy.preflight import pad_of
from deploy.radio.cache import toc_cache
from deploy.radio.simulated.air.air import Air
from deploy.radio.simulated.air.model import AirModel, stations
from deploy.radio.simulated.physics.world import World
from deploy.radio.simulated.swarm import SimulatedSwarm
from missions.airframes import airframe
from missions.schema import Mission
from mocap.simulated import SimulatedMocap
from mocap.source import Pose
from planner.flightplan import FlightPlan

_MOCAP_RATE = 100.0  # Hz
_PATIENCE = 60.0  # s of wall time


class Stage:
    """Everything a rehearsal simulates: world, radio, motion capture and clock, not yet flying.

    A context manager; tests reach in to break things.

    Args:
        mission: whose robots stand on their pads. seed: of everything random.
        speed: at most this many times faster than wall time; None: as fast as possible.
        label: host part of the sim:// URIs.

    Attributes:
        world, clock, mocap, swarm: the parts.
    """

    def __init__(
        self,
        mission: Mission,
        *,
        seed: int = 0,
        speed: float | None = None,
        label: str = "rehearsal",
        air: AirModel | None = None,
    ) -> None:
        names = [robot.name for robot in mission.robots]
        pads = np.array([[*pad_of(mission, name), 0.0] for name in names])
        self.clock = VirtualClock(speed=speed, patience=_PATIENCE)
        self.world = World([airframe(mission.flight.airframe)] * len(names), pads, np.zeros(len(names)), seed=seed)
        self.mocap = SimulatedMocap(_MOCAP_RATE, seed=seed)
        self._bodies = [robot.rigid_body or robot.name for robot in mission.robots]
        self.world.every(1.0 / _MOCAP_RATE, self._expose)
        arms_itself = "brushless" not in mission.flight.airframe
        self.air = None
        if air is not None:
            self.air = Air(air, stations(mission), seed=seed, held=lambda: self.clock.held)
        self.swarm = SimulatedSwarm(names, self.world, self.clock, label=label, auto_arm=arms_itself, air=self.air)
        # The loop reads telemetry right after a tick: by then the clients must have digested what that tick sent.
        self.clock.attach(lambda t: _digest(self.swarm), lambda timeout: True)

    def __enter__(self) -> Stage:
        return self

    def __exit__(self, *_: object) -> None:
        self.mocap.close()
        self.swarm.close()

    def _expose(self, t: float) -> None:
        if not self.mocap.due(t):
            return
        positions, quaternions = self.world.positions.tolist(), self.world.quaternions.tolist()
        poses = {
            body: Pose(tuple(p), tuple(q)) for body, p, q in zip(self._bodies, positions, quaternions, strict=True)
        }
        self.mocap.observe(t, poses)


def _digest(swarm: SimulatedSwarm) -> None:
    swarm.settle(_PATIENCE)


def rehearse(
    flight_plan: FlightPlan,
    *,
    log_path: str | Path,
    seed: int = 0,
    speed: float | None = None,
    observer: Callable[[FlightStatus], None] | None = None,
    operator: Operator | None = None,
) -> tuple[FlightOutcome, Path]:
    """Fly a plan on simulated drones.

    Args:
        flight_plan: what to fly.
        log_path: flight log to write; must not exist.
        seed: of the simulation; the same seed gives the same flight.
        speed: at most this many times faster than wall time; None: as fast as possible.
        observer: told ten times a simulated second how it goes.
        operator: who may end the flight.

    Returns:
        How it ended, and the log.

    Raises:
        DeployError: as ``fly``; LogFileError if the log cannot be written.
    """
    metadata = {
        **flight_plan.versions,
        "backend": "simulated",
        "seed": str(seed),
        "simulation": deploy.radio.simulated.__doc__ or "",
    }
    attachments = {"plan.mcap": plan_bytes(flight_plan)}
    with (
        Stage(flight_plan.mission, seed=seed, speed=speed) as stage,
        FlightLog(log_path, stage.clock.epoch, attachments, metadata, when_full="wait") as log,
    ):
        outcome = fly(
            flight_plan,
            uris=stage.swarm.uris(),
            mocap=stage.mocap,
            clock=stage.clock,
            log=log,
            operator=operator,
            observer=observer,
            toc_cache=toc_cache("simulated"),
        )
    return outcome, log.path
