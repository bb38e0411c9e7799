"""A flight on simulated drones: the same ``fly``, other URIs, another pose source, another clock."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

import deploy.radio.simulated
import deploy.radio.simulated.physics
from deploy.clock import VirtualClock
from deploy.errors import DeployError
from deploy.execute import Equipment, fly
from deploy.flight.records import FlightOutcome, FlightStatus
from deploy.flightlog.attachments import attachments
from deploy.operator import Either, Interrupts, Nobody, Operator
from deploy.radio.simulated.air.air import Air
from deploy.radio.simulated.air.model import AirModel, stations
from deploy.radio.simulated.physics.capture import film
from deploy.radio.simulated.physics.world import World
from deploy.radio.simulated.positioning import OnboardPositioning
from deploy.radio.simulated.swarm import SimulatedSwarm
from deploy.replanner import Replanner
from deploy.scenario.aftermath import watch_alone
from deploy.scenario.director import Director
from deploy.scenario.effects import Props
from deploy.scenario.killed import HostDied, ProcessKilled
from deploy.scenario.log import RehearsalLog
from deploy.scenario.records import Scenario
from deploy.tables import known_tables
from missions.airframes import airframe
from missions.decks import DECKS, DeckName
from missions.fleet import pads
from missions.schema import Mission
from mocap.setup import seen_by
from mocap.simulated import SimulatedMocap
from mocap.source import MocapSource
from planner.flightplan import FlightPlan

_MOCAP_RATE = 100.0  # Hz
_POSITIONING: DeckName = "lighthouse4"  # the one that the simulation has poses from
_PATIENCE = 60.0  # s of wall time


class Stage:
    """Everything a rehearsal simulates: world, radio, motion capture and clock, not yet flying.

    A context manager; tests reach in to break things.

    Args:
        mission: whose robots stand on their pads. seed: of everything random.
        speed: at most this many times faster than wall time; None: as fast as possible.
        label: host part of the sim:// URIs.
        air: the radio; None: an ideal one.
        decks: what is plugged into every drone besides what the mission says.

    Attributes:
        world, clock, mocap, swarm, air: the parts.
        capture: what the mission's system reports of what ``mocap`` sees; this is what flies.
        operator: whom a scenario may have press Ctrl-C.
    """

    def __init__(
        self,
        mission: Mission,
        *,
        seed: int = 0,
        speed: float | None = None,
        label: str = "rehearsal",
        air: AirModel | None = None,
        decks: tuple[DeckName, ...] = (),
    ) -> None:
        names = [robot.name for robot in mission.robots]
        places = np.column_stack([pads(mission), np.zeros(len(names))])
        self.clock = VirtualClock(speed=speed, patience=_PATIENCE)
        frame = airframe(mission.flight.airframe)
        self.world = World([frame] * len(names), places, np.zeros(len(names)), seed=seed)
        self.mocap = SimulatedMocap(_MOCAP_RATE, seed=seed)
        self.capture = seen_by(self.mocap, mission, seed)
        self._bodies = {robot.name: robot.rigid_body or robot.name for robot in mission.robots}
        film(self.world, list(self._bodies.values()), self.mocap, 1.0 / _MOCAP_RATE)
        arms_itself = "brushless" not in mission.flight.airframe
        self.clock.attach(self._live, lambda timeout: True)
        self.air = None
        if air is not None:
            self.air = Air(air, stations(mission), seed=seed, held=lambda: self.clock.held)
        boards = {
            robot.name: tuple(DECKS[deck].board for deck in dict.fromkeys((*robot.decks, *decks)))
            for robot in mission.robots
        }
        self.swarm = SimulatedSwarm(
            names, self.world, self.clock, label=label, auto_arm=arms_itself, airframe=frame, decks=boards, air=self.air
        )
        self.operator = Interrupts()
        self._mission, self._seed = mission, seed
        self._killed: ProcessKilled | None = None
        self._director: Director | None = None
        self.clock.attach(self._act, lambda timeout: True)
        # The loop reads telemetry right after a tick: by then the clients must have digested what that tick sent.
        self.clock.attach(lambda t: _digest(self.swarm), lambda timeout: True)

    def __enter__(self) -> Stage:
        return self

    def __exit__(self, *_: object) -> None:
        self.mocap.close()
        self.swarm.close()

    def play(self, scenario: Scenario, log: RehearsalLog) -> Props:
        """From now on, let happen what a scenario says; it is written into the log. Returns what it breaks.

        Raises:
            DeployError: there is no modelled radio that could fail.
        """
        if self.air is None:
            raise DeployError("a scenario needs a radio that can fail; this one is ideal (radio.rehearsal: modelled)")
        props = Props(self._bodies, self.world, self.mocap, self.swarm, self.air, self.operator)
        self._director = Director(scenario, self._mission, props, log)
        log.listener = self._director.hear
        return props

    def begin(self) -> None:
        """Let happen what happens before anybody connects. Raises ProcessKilled."""
        self._act(0.0)

    def position(self) -> MocapSource | None:
        """What tells where drones are: motion capture, or, if all have Lighthouse decks, those (then None)."""
        if not all(_POSITIONING in robot.decks for robot in self._mission.robots):
            return self.capture
        OnboardPositioning(self.world, list(self.swarm.drones.values()), self._seed)
        return None

    def _live(self, t: float) -> None:
        if self._killed is not None:
            raise self._killed

    def _act(self, t: float) -> None:
        if self._director is None:
            return
        try:
            self._director.advance(t)
        except ProcessKilled as killed:
            self._killed = killed
            raise


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
    scenario: Scenario | None = None,
    tap: Callable[[int, str, bytes], None] | None = None,
    witness: Callable[[Stage], None] | None = None,
    replanner: Replanner | None = None,
    new_map: Callable[[], str | None] = lambda: None,
) -> tuple[FlightOutcome, Path]:
    """Fly a plan on simulated drones, over a radio as the mission says.

    Args:
        flight_plan: what to fly.
        log_path: flight log to write; must not exist.
        seed: of the simulation; the same seed gives the same flight.
        speed: at most this many times faster than wall time; None: as fast as possible.
        observer: told ten times a simulated second how it goes.
        operator: who may end the flight.
        scenario: what goes wrong; default: nothing.
        tap: is told every record of the log, as ``FlightLog.tap``.
        witness: shown the stage before anybody flies, to see what really happens.
        replanner: who plans anew when the map changes; None: nobody.
        new_map: a map that somebody has told, as text, once; None: nothing new.

    Returns:
        How it ended, and the log.

    Raises:
        DeployError: as ``fly``; LogFileError if the log cannot be written; HostDied if the scenario killed the
            process: then the log is ``<log_path>.part``.
    """
    mission = flight_plan.mission
    ideal = mission.radio.rehearsal == "ideal"
    metadata = {
        **flight_plan.versions,
        "backend": "simulated",
        "seed": str(seed),
        "radio": mission.radio.rehearsal,
        "simulation": f"{deploy.radio.simulated.__doc__}\n{deploy.radio.simulated.physics.__doc__}",
    }
    if scenario is not None:
        metadata["scenario"] = scenario.text
    with (
        known_tables() as tables,
        Stage(mission, seed=seed, speed=speed, air=None if ideal else AirModel.of(mission)) as stage,
        RehearsalLog(
            log_path,
            stage.clock.epoch,
            attachments(flight_plan, stage.swarm.uris(), scenario.text if scenario else ""),
            metadata,
            when_full="wait",
        ) as log,
    ):
        log.tap = tap
        if witness is not None:
            witness(stage)
        props = None if scenario is None else stage.play(scenario, log)
        try:
            stage.begin()
            who = Either(operator or Nobody(), stage.operator)
            equipment = Equipment(
                stage.swarm.uris(), stage.position(), stage.clock, log, who, observer, tables, replanner, new_map
            )
            outcome = fly(flight_plan, equipment)
        except ProcessKilled as killed:
            if props is None:
                raise
            raise HostDied(stage.world.t, watch_alone(props, killed.watch)) from None
    return outcome, log.file
