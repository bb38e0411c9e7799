"""A flight on hardware: the same ``fly`` with Crazyradio links and wall time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from deploy.clock import SystemClock
from deploy.errors import LinkError
from deploy.execute import Equipment, check, fly
from deploy.flight.records import FlightOutcome, FlightStatus
from deploy.flightlog.attachments import attachments
from deploy.flightlog.writer import FlightLog
from deploy.operator import Operator
from deploy.preflight import PreflightReport
from deploy.radio.cache import toc_cache
from deploy.radio.drivers import initialise, require_crazyradio
from deploy.replanner import Replanner
from missions.schema import Mission
from mocap.source import MocapSource
from planner.flightplan import FlightPlan

T = TypeVar("T")


def uris_of(mission: Mission) -> Mapping[str, str]:
    """Link URI by robot, as the mission gives them.

    Raises:
        LinkError: a robot has none, or two have the same.
    """
    uris = {robot.name: robot.uri for robot in mission.robots}
    if missing := [name for name, uri in uris.items() if not uri]:
        raise LinkError(f"no uri for {', '.join(missing)}; add 'uri: radio://0/80/2M/E7E7E7E7..' to each robot")
    if len(set(uris.values())) != len(uris):
        double = sorted({uri for uri in uris.values() if list(uris.values()).count(uri) > 1})
        raise LinkError(f"several robots have the same uri: {', '.join(double)}")
    return uris


def prepare_links(mission: Mission) -> Mapping[str, str]:
    """Set up cflib's drivers for the mission's robots; link URI by robot.

    Raises:
        LinkError: no URIs, or no Crazyradio although a URI needs one.
    """
    uris = uris_of(mission)
    initialise()
    if any(uri.startswith("radio://") for uri in uris.values()):
        require_crazyradio()
    return uris


def fly_hardware(
    flight_plan: FlightPlan,
    *,
    log_path: str | Path,
    mocap: Callable[[SystemClock], MocapSource | None],
    operator: Operator,
    observer: Callable[[FlightStatus], None] | None = None,
    tap: Callable[[int, str, bytes], None] | None = None,
    replanner: Replanner | None = None,
    new_map: Callable[[], str | None] = lambda: None,
) -> tuple[FlightOutcome, Path]:
    """Fly a plan on real drones.

    Args:
        flight_plan: what to fly.
        log_path: flight log to write; must not exist.
        mocap: makes the motion capture on the flight's clock; returns None for on-board positioning.
        operator: who may end the flight.
        observer: told ten times a second how it goes.
        tap: is told every record of the log, as ``FlightLog.tap``.
        replanner: who plans anew when the map changes; None: nobody.
        new_map: a map that somebody has told, as text, once; None: nothing new.

    Returns:
        How it ended, and the log (``<log_path>.part`` if the disk failed meanwhile).

    Raises:
        LinkError: no radio, or no URIs. DeployError: as ``fly``.
    """

    def act(plan: FlightPlan, equipment: Equipment) -> FlightOutcome:
        return fly(plan, replace(equipment, replanner=replanner, new_map=new_map))

    return _on_hardware(act, flight_plan, log_path, mocap, operator, observer, tap)


def check_hardware(
    flight_plan: FlightPlan,
    *,
    log_path: str | Path,
    mocap: Callable[[SystemClock], MocapSource | None],
    operator: Operator,
    observer: Callable[[FlightStatus], None] | None = None,
    tap: Callable[[int, str, bytes], None] | None = None,
) -> tuple[PreflightReport, Path]:
    """Make every pre-flight check on real drones and fly nothing; as :func:`fly_hardware` else."""
    return _on_hardware(check, flight_plan, log_path, mocap, operator, observer, tap)


def _on_hardware(
    act: Callable[[FlightPlan, Equipment], T],
    flight_plan: FlightPlan,
    log_path: str | Path,
    mocap: Callable[[SystemClock], MocapSource | None],
    operator: Operator,
    observer: Callable[[FlightStatus], None] | None,
    tap: Callable[[int, str, bytes], None] | None,
) -> tuple[T, Path]:
    uris = prepare_links(flight_plan.mission)
    clock = SystemClock()
    source = mocap(clock)
    try:
        metadata = {**flight_plan.versions, "backend": "hardware"}
        with FlightLog(log_path, clock.epoch, attachments(flight_plan, uris), metadata) as log:
            log.tap = tap
            cache = toc_cache("hardware")
            result = act(flight_plan, Equipment(uris, source, clock, log, operator, observer, cache))
    finally:
        if source is not None:
            source.close()
    return result, log.file
