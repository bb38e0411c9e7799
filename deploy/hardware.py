"""A flight on hardware: the same ``fly`` with Crazyradio links and wall time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeVar

from deploy.clock import SystemClock
from deploy.errors import LinkError
from deploy.execute import Equipment, check, fly
from deploy.flight.records import FlightOutcome
from deploy.flightlog.attachments import attachments
from deploy.flightlog.writer import FlightLog
from deploy.preflight import PreflightReport
from deploy.radio.cache import toc_cache
from deploy.radio.drivers import initialise, require_crazyradio
from deploy.replanner import Replanner
from deploy.watch import Watch
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
    watch: Watch,
    replanner: Replanner | None = None,
) -> tuple[FlightOutcome, Path]:
    """Fly a plan on real drones.

    Args:
        flight_plan: what to fly.
        log_path: flight log to write; must not exist.
        mocap: makes the motion capture on the flight's clock; returns None for on-board positioning.
        watch: who may end the flight, and who is told how it goes.
        replanner: who plans anew when the map changes; None: nobody.

    Returns:
        How it ended, and the log (``<log_path>.part`` if the disk failed meanwhile).

    Raises:
        LinkError: no radio, or no URIs. DeployError: as ``fly``.
    """
    return _on_hardware(fly, flight_plan, log_path, mocap, watch, replanner)


def check_hardware(
    flight_plan: FlightPlan,
    *,
    log_path: str | Path,
    mocap: Callable[[SystemClock], MocapSource | None],
    watch: Watch,
) -> tuple[PreflightReport, Path]:
    """Make every pre-flight check on real drones and fly nothing; as :func:`fly_hardware` else."""
    return _on_hardware(check, flight_plan, log_path, mocap, watch)


def _on_hardware(
    act: Callable[[FlightPlan, Equipment], T],
    flight_plan: FlightPlan,
    log_path: str | Path,
    mocap: Callable[[SystemClock], MocapSource | None],
    watch: Watch,
    replanner: Replanner | None = None,
) -> tuple[T, Path]:
    uris = prepare_links(flight_plan.mission)
    clock = SystemClock()
    source = mocap(clock)
    try:
        metadata = {**flight_plan.versions, "backend": "hardware"}
        with FlightLog(log_path, clock.epoch, attachments(flight_plan, uris), metadata) as log:
            log.tap = watch.tap
            cache, told = toc_cache("hardware"), watch.observer
            equipment = Equipment(uris, source, clock, log, watch.operator, told, cache, replanner, watch.new_map)
            result = act(flight_plan, equipment)
    finally:
        if source is not None:
            source.close()
    return result, log.file
