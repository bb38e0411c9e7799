"""Everybody to a stop, where ``stops.py`` says: from what is flown now, told and not told."""

from __future__ import annotations

import math
from collections.abc import Collection

from deploy.flight.commands import command, refusals
from deploy.flight.loop import Flight, Vec3
from deploy.flight.reference import Way
from deploy.flight.stops import Moving, Space, Stops, stop
from deploy.flight.touchdown import OFF_THE_GROUND, height
from deploy.radio import highlevel
from planner.transfer.descent import clear_way

CALM = 0.5  # s of hover between braking and landing
_ON_PLAN = 0.15  # m between reference and telemetered setpoint
_INSTANT = 0.01  # s; differences over it are velocities and accelerations


def brake(flight: Flight, names: Collection[str], since: float) -> None:
    """Everybody to a stop in the same time; measures how long after ``since`` they heard."""
    stops = _stops(flight, names)
    flight.allow(max(stops.durations.values(), default=0.0) + CALM)
    commands = {
        name: highlevel.go_to(target, _yaw(flight, name), stops.durations[name])
        for name, target in stops.targets.items()
    }
    if refused := refusals(command(flight, commands, patience=0.5)):
        flight.event("brake", refused, level="warning")
    if not math.isnan(since):
        flight.timing.reaction = taken = flight.clock.now() - since
        text = f"everybody told to brake {taken * 1000:.0f} ms after the first sign"
        flight.event("reaction", text, value=taken)
    now = flight.clock.now()
    for name, target in stops.targets.items():  # whoever is lost from here on is expected there
        here = flight.where.position(name) or target
        flight.courses.ways[name] = Way(here, target, now, stops.durations[name])
    for name, way in stops.moved.items():
        flight.event("brake", f"waits {way:.2f} m beside where it would have stopped", robot=name, level="warning")
    flight.wait(max(stops.durations.values(), default=0.0) + CALM)


def halt(flight: Flight, name: str) -> None:
    """Tell one whose link is back to stop, too; what it answers is seen when it is told to land."""
    if height(flight, name) <= OFF_THE_GROUND:
        return
    stops = _stops(flight, [name])
    target, duration = stops.targets[name], stops.durations[name]
    flight.fleet[name].send(highlevel.go_to(target, _yaw(flight, name), duration))
    flight.courses.ways[name] = Way(flight.where.position(name) or target, target, flight.clock.now(), duration)


def _stops(flight: Flight, names: Collection[str]) -> Stops:
    strays = flight.where.strays()
    drones = {name: _moving(flight, name) for name in names}
    for name, later in strays.items():
        drones[name] = Moving(later(0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), later, told=False)
    ordered = {name: drones[name] for name in flight.fleet if name in drones}
    after = CALM + flight.plan.mission.flight.landing_duration
    mission = flight.plan.mission

    def clear(name: str, place: Vec3) -> bool:
        return clear_way(mission, name, ordered[name].position, place)

    return stop(ordered, Space.of(mission, flight.where.ground), after=after, clear=clear)


def _moving(flight: Flight, name: str) -> Moving:
    """What the commander asks of a drone now, and where that leads: where a new move begins."""
    target, now = flight.fleet[name].target, flight.clock.now()
    before, here, soon = (flight.courses.at(name, now + dt) for dt in (-_INSTANT, 0.0, _INSTANT))
    # Telemetry is a little old, the course is not; but a drone may be flying something else.
    if before and here and soon and (target is None or math.dist(target.position, here) <= _ON_PLAN):
        u, v, w = ((b - a) / (2.0 * _INSTANT) for a, b in zip(before, soon, strict=True))
        x, y, z = ((b - 2.0 * p + a) / _INSTANT**2 for a, p, b in zip(before, here, soon, strict=True))
        later = lambda t: flight.courses.at(name, now + t) or here  # noqa: E731
        return Moving(here, (u, v, w), (x, y, z), later, left=flight.courses.left(name, now))
    position, velocity = flight.where.position(name) or flight.courses.start(name), (0.0, 0.0, 0.0)
    if target is not None:
        position, velocity = target.position, target.velocity
    return Moving(position, velocity, (0.0, 0.0, 0.0), lambda t: _straight(position, velocity, t))


def _straight(position: Vec3, velocity: Vec3, t: float) -> Vec3:
    x, y, z = (p + v * t for p, v in zip(position, velocity, strict=True))
    return x, y, z


def _yaw(flight: Flight, name: str) -> float:
    estimate = flight.fleet[name].estimate
    return estimate.rpy[2] if estimate else 0.0
