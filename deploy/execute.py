"""Stage 6 of 7: fly a plan, from the first packet to the last; hardware and rehearsal alike.

Nothing here knows whether drones, motion capture and clock are real. The sequence is the table in ``phases.py``;
whatever goes wrong in the air, including a bug of ours, brings everybody down before anything else is said.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from deploy.clock import Clock
from deploy.errors import DeployError
from deploy.flight import manoeuvres, passages
from deploy.flight.abort import abort, stop_motors
from deploy.flight.keepalive import Keepalive
from deploy.flight.loop import EmergencyStop, Flight
from deploy.flight.muster import Muster
from deploy.flight.reactions import Reaction
from deploy.flight.records import FlightOutcome, FlightStatus
from deploy.flight.status import status_of
from deploy.flightlog.writer import FlightLog
from deploy.operator import Nobody, Operator
from deploy.phases import Phase
from deploy.preflight import PreflightReport, check_plan
from deploy.radio.drone import Drone
from deploy.radio.fleet import Fleet, FleetError
from deploy.replanner import Replanner
from mocap.source import MocapSource
from planner.flightplan import FlightPlan


@dataclass(frozen=True)
class Equipment:
    """What a flight is flown with; nothing in it says whether it is real.

    Attributes:
        uris: link URI by robot.
        mocap: where the drones are seen; None if they position themselves. Whoever made it closes it.
        clock: of everything.
        log: where everything is written. Whoever made it closes it.
        operator: who may end the flight.
        observer: told ten times a second how it goes; must return quickly.
        toc_cache: folder for the drones' tables of contents.
        replanner: who plans anew when the map changes; None: nobody.
        new_map: a map that somebody has told, as text, once; None: nothing new.
    """

    uris: Mapping[str, str]
    mocap: MocapSource | None
    clock: Clock
    log: FlightLog
    operator: Operator = Nobody()  # noqa: RUF009 - has no state
    observer: Callable[[FlightStatus], None] | None = None
    toc_cache: Path | None = None
    replanner: Replanner | None = None
    new_map: Callable[[], str | None] = lambda: None


def fly(flight_plan: FlightPlan, equipment: Equipment) -> FlightOutcome:
    """Fly a certified plan: its certificate has to pass and to be for these bytes.

    Returns:
        How it ended, also after an abort or an emergency stop.

    Raises:
        PreflightError: checks failed; nobody has moved.
        FleetError: drones could not be connected, set up or loaded; nobody has moved.
        FlightAborted: it ended before take-off (a drone did not get ready, or the operator said so).
    """
    PreflightReport(check_plan(flight_plan)).require()
    flight = _flight(flight_plan, equipment)
    try:
        return _fly(flight)
    finally:
        _close(flight)


def check(flight_plan: FlightPlan, equipment: Equipment) -> PreflightReport:
    """Make every pre-flight check of a plan and its drones, and fly nothing.

    Drones that cannot be connected fail the check ``connection``; the others are checked all the same.

    Raises:
        FlightAborted: the operator said so.
    """
    flight = _flight(flight_plan, equipment)
    try:
        return Muster(flight).check()
    finally:
        _close(flight)


def _flight(flight_plan: FlightPlan, equipment: Equipment) -> Flight:
    uris, clock = equipment.uris, equipment.clock
    names = [robot.name for robot in flight_plan.mission.robots]
    if missing := [name for name in names if not uris.get(name)]:
        raise DeployError(f"no link URI for {', '.join(missing)}; give each robot a 'uri' in the mission")
    fleet = Fleet([Drone(name, uris[name], clock, equipment.toc_cache) for name in names], clock)
    told = equipment.observer
    observer = None if told is None else lambda flight: told(status_of(flight))
    flight = Flight(flight_plan, fleet, equipment.mocap, clock, equipment.log, equipment.operator, observer)
    flight.replanner, flight.new_map = equipment.replanner, equipment.new_map
    return flight


def _fly(flight: Flight) -> FlightOutcome:
    began = flight.clock.now()
    report, landed = PreflightReport(), {}
    reason = ""
    keepalive = Keepalive(flight.fleet, flight.clock, lambda: flight.turned)
    try:
        report = Muster(flight).make_ready()
        if flight.plan.mission.safety.on_host_loss == "motor_stop":
            keepalive.start()
            flight.event("keepalive", "from now on drones that hear nothing for a second stop their motors")
        landed = _airborne(flight)
    except EmergencyStop:
        reason = "the operator stopped the motors"
        landed = _emergency(flight)
    except DeployError as error:
        if not flight.phases.airborne:
            flight.enter(Phase.CANCELLED)
            flight.event("cancelled", str(error), level="fault")
            raise
        landed, reason = _bring_down(flight, error if isinstance(error, Reaction) else Reaction(str(error)))
    finally:
        if flight.phases.airborne:  # something nobody foresaw is on its way up
            _bring_down(flight, Reaction("the flight software failed"))
        keepalive.stop()
    return _outcome(flight, began, reason, report, landed)


def _airborne(flight: Flight) -> dict[str, bool]:
    """Everything from take-off to landing; returns who is down."""
    passages.take_off(flight)
    passages.transfer(flight)
    passages.settle(flight)
    manoeuvres.start_together(flight)
    manoeuvres.search(flight)
    passages.go_back(flight)
    return manoeuvres.land(flight)


def _bring_down(flight: Flight, reaction: Reaction) -> tuple[dict[str, bool], str]:
    try:
        return abort(flight, reaction), str(reaction)
    except EmergencyStop:
        return _emergency(flight), f"{reaction}; then the operator stopped the motors"


def _emergency(flight: Flight) -> dict[str, bool]:
    if not flight.phases.airborne and flight.phases.now is not Phase.ARMED:
        flight.enter(Phase.CANCELLED)  # nothing turns: there is nothing to stop
        return dict.fromkeys(flight.fleet, True)
    stop_motors(flight)
    return dict.fromkeys(flight.fleet, False)


def _close(flight: Flight) -> None:
    """Close all links; never one of a drone that flies."""
    if not (flight.phases.airborne or flight.phases.over):
        flight.enter(Phase.CANCELLED)
    flight.watching, force = False, flight.phases.now is Phase.EMERGENCY
    try:
        flight.fleet.each("closing the link", lambda drone: drone.close(force=force), flight.tick)
    except FleetError as error:
        for name, problem in error.errors.items():
            flight.fault("close", name, str(problem))


def _outcome(
    flight: Flight, began: float, reason: str, report: PreflightReport, landed: Mapping[str, bool]
) -> FlightOutcome:
    if not reason and not all(landed.values()):
        reason = f"not known to be on the ground: {', '.join(name for name, down in landed.items() if not down)}"
    for name, latency in flight.timing.latencies.items():
        flight.event("command_latency", str(latency), robot=name, value=latency.median)
    return FlightOutcome(
        phase=flight.phases.now,
        reason=reason,
        preflight=report,
        faults=tuple(flight.journal.faults),
        warnings=tuple(flight.journal.warnings),
        landed=MappingProxyType(dict(landed)),
        start_skew=flight.courses.search.skew,
        largest_error=MappingProxyType(dict(flight.lookout.largest_error)),
        duration=flight.clock.now() - began,
        left_behind=MappingProxyType(dict(flight.left_behind)),
        latencies=flight.timing.latencies,
        reaction=flight.timing.reaction,
    )
