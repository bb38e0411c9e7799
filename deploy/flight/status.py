"""A flight in a few words, for those who watch it."""

from __future__ import annotations

import math

from deploy.flight.loop import Flight
from deploy.flight.records import FlightStatus, RobotStatus


def status_of(flight: Flight) -> FlightStatus:
    """The whole flight now."""
    now = flight.clock.now()
    robots = []
    for name, drone in flight.fleet.items():
        position, target = flight.where.position(name), flight.reference(name, now)
        error = math.dist(position, target) if position and target else math.nan
        said, link = drone.status, drone.link
        robots.append(
            RobotStatus(
                name=name,
                position=position,
                error=error,
                voltage=said.voltage if said else math.nan,
                latency=link.latency,
                note=flight.notes[name] or link.lost,
                target=target,
                state=said.supervisor.word if said else "",
                level=said.level if said else math.nan,
                quality=link.quality,
            )
        )
    return FlightStatus(
        t=now,
        phase=flight.phases.now,
        mission_time=now - flight.courses.search.start,
        duration=flight.courses.duration,
        robots=tuple(robots),
        message=flight.journal.message,
        ergodicity=flight.picture.ergodicity,
        certified=flight.plan.certificate.indicators.ergodicity,
    )
