"""How a flight ends early: everybody brakes together, then what the mission's policy or the operator says.

Nothing here begins before everybody has stopped, and everybody stops where nobody meets anybody (``stops.py``). Then
they land in turn (``landing.py``), fly home along ways planned from where all are, or wait.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping

from deploy.flight.landing import may_fall, with_those_below
from deploy.flight.loop import Flight, Vec3
from deploy.flight.passages import fly
from deploy.flight.reactions import Reaction
from deploy.flight.reference import Way
from deploy.flight.stops import Moving, Space, Stops, stop
from deploy.flight.touchdown import OFF_THE_GROUND, height, land_in_turn, land_latecomers, put_to_rest
from deploy.phases import Phase
from deploy.radio import highlevel
from missions.schema import Mission
from planner.transfer.descent import clear_descents, clear_way, ways_home
from planner.transfer.errors import TransferError
from planner.transfers import Passage

Planner = Callable[[Mission, Mapping[str, Vec3], Collection[str]], Passage]

_ON_PLAN = 0.15  # m between reference and telemetered setpoint
_CALM = 0.5  # s of hover between braking and landing
_LONGEST_FALL = 2.0  # s: from 20 m
_INSTANT = 0.01  # s; differences over it are velocities and accelerations


def abort(flight: Flight, reaction: Reaction) -> dict[str, bool]:
    """Bring down those in the air, the way the reaction says; returns who is down.

    Landing from motion would stop with a jerk (the commander plans landings from rest), so everybody brakes first.
    """
    flight.watching = False
    if flight.phases.now not in (Phase.LANDING, Phase.ABORTING):  # ABORTING: a bug on the way down
        flight.enter(Phase.ABORTING)
    flight.event("abort", f"{reaction} ({reaction.policy})", level="fault")
    if reaction.policy == "stop_motors":
        reaction = _drop(flight, reaction)
    flying = [name for name in flight.alive if height(flight, name) > OFF_THE_GROUND]
    grounded = [name for name in flight.alive if name not in flying]
    flight.command({name: highlevel.stop() for name in grounded}, patience=0.3)
    down: dict[str, bool] = {}
    if flying and flight.phases.now is Phase.ABORTING:
        _brake(flight, flying, reaction.since)
        flight.on_return = lambda name: _halt(flight, name)
        if reaction.policy == "hold":
            reaction = _hold(flight)
        if reaction.policy == "land_here":
            down = _land_first(flight, flying, reaction.robots)
        rest = [name for name in flying if name not in down]
        if rest and not (reaction.policy in ("return", "land_here") and _over_the_pads(flight, rest)):
            _step_aside(flight, rest)
    down |= land_in_turn(flight, [name for name in flight.alive if name not in down])
    landed = put_to_rest(flight, down | land_latecomers(flight, down))
    flight.enter(Phase.ABORTED)
    return landed


def stop_motors(flight: Flight) -> None:
    """The operator's second word: motors off, in whatever height."""
    _cut_motors(flight, flight.fleet)
    flight.watching = False
    flight.enter(Phase.EMERGENCY)
    flight.event("emergency", "the operator stopped the motors", level="fault")
    # To the ground: the log is to show where they fell.
    flight.wait_until(lambda: all(height(flight, n) < OFF_THE_GROUND for n in flight.alive), _LONGEST_FALL)
    flight.wait(_CALM)


# ---------------------------------------------------------------------------------------------------- stopping


def _brake(flight: Flight, names: Collection[str], since: float) -> None:
    """Everybody to a stop in the same time; measures how long after ``since`` they heard."""
    stops = _stops(flight, names)
    commands = {
        name: highlevel.go_to(target, _yaw(flight, name), stops.durations[name])
        for name, target in stops.targets.items()
    }
    if refused := flight.refusals(flight.command(commands, patience=0.5)):
        flight.event("brake", refused, level="warning")
    if not math.isnan(since):
        flight.timing.reaction = taken = flight.clock.now() - since
        text = f"everybody told to brake {taken * 1000:.0f} ms after the first sign"
        flight.event("reaction", text, value=taken)
    now = flight.clock.now()
    for name, target in stops.targets.items():  # whoever is lost from here on is expected there
        here = flight.position(name) or target
        flight.courses.ways[name] = Way(here, target, now, stops.durations[name])
    for name, way in stops.moved.items():
        flight.event("brake", f"waits {way:.2f} m beside where it would have stopped", robot=name, level="warning")
    flight.wait(max(stops.durations.values(), default=0.0) + _CALM)


def _halt(flight: Flight, name: str) -> None:
    """Tell one whose link is back to stop, too; what it answers is seen when it is told to land."""
    if height(flight, name) <= OFF_THE_GROUND:
        return
    stops = _stops(flight, [name])
    target, duration = stops.targets[name], stops.durations[name]
    flight.fleet[name].send(highlevel.go_to(target, _yaw(flight, name), duration))
    flight.courses.ways[name] = Way(flight.position(name) or target, target, flight.clock.now(), duration)


def _stops(flight: Flight, names: Collection[str]) -> Stops:
    strays = flight.strays()
    drones = {name: _moving(flight, name) for name in names}
    for name, later in strays.items():
        drones[name] = Moving(later(0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), later, told=False)
    ordered = {name: drones[name] for name in flight.fleet if name in drones}
    after = _CALM + flight.plan.mission.flight.landing_duration
    mission = flight.plan.mission

    def clear(name: str, place: Vec3) -> bool:
        return clear_way(mission, name, ordered[name].position, place)

    return stop(ordered, Space.of(mission, flight.ground), after=after, clear=clear)


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
    position, velocity = flight.position(name) or flight.courses.start(name), (0.0, 0.0, 0.0)
    if target is not None:
        position, velocity = target.position, target.velocity
    return Moving(position, velocity, (0.0, 0.0, 0.0), lambda t: _straight(position, velocity, t))


def _straight(position: Vec3, velocity: Vec3, t: float) -> Vec3:
    x, y, z = (p + v * t for p, v in zip(position, velocity, strict=True))
    return x, y, z


def _yaw(flight: Flight, name: str) -> float:
    estimate = flight.fleet[name].estimate
    return estimate.rpy[2] if estimate else 0.0


# ---------------------------------------------------------------------------------------------------- then


def _drop(flight: Flight, reaction: Reaction) -> Reaction:
    """Stop the motors of those it is about, if nobody is below; who has somebody below lands like everybody."""
    separation = flight.plan.mission.limits.separation
    positions = {name: position for name in flight.fleet if (position := flight.position(name)) is not None}
    names = list(dict.fromkeys(reaction.robots))
    for name in names:
        estimate = flight.fleet[name].estimate
        velocity = estimate.velocity if estimate else (0.0, 0.0, 0.0)
        if name in positions and not may_fall(name, positions, velocity, separation):
            text = "its motors are not stopped: it would fall onto another drone; it lands"
            flight.event("emergency", text, robot=name, level="fault")
            continue
        _cut_motors(flight, [name])
        flight.event("emergency", "motors stopped by the mission's policy", robot=name, level="fault")
    return reaction


def _cut_motors(flight: Flight, names: Iterable[str]) -> None:
    for _ in range(3):  # nobody answers this packet
        for name in names:
            flight.fleet[name].emergency_stop()


def _land_first(flight: Flight, flying: Collection[str], concerned: Collection[str]) -> dict[str, bool]:
    """Those it is about on the spot, whoever is below them before; the others wait. Who is known to be down."""
    hovering = {name: position for name in flying if (position := flight.position(name)) is not None}
    first = with_those_below(concerned, hovering, flight.plan.mission.limits.separation)
    if not first:
        return {}
    waiting = [name for name in flying if name not in first]
    if waiting:
        flight.event("landing", f"{', '.join(first)} first; {', '.join(waiting)} wait", level="warning")
    _step_aside(flight, first)
    return land_in_turn(flight, first)


def _hold(flight: Flight) -> Reaction:
    """Everybody hovers where he stopped; returns how it goes on from here: never in a hover."""
    safety, operator = flight.plan.mission.safety, flight.operator
    flight.event("hold", f"everybody hovers, for at most {safety.hold_time:g} s", level="warning")
    flight.watching = True
    try:
        called = flight.wait_until(operator.return_requested, safety.hold_time)
        after = Reaction("the hover is over", "return" if called else "land_all")
    except Reaction as reaction:
        after = reaction if reaction.policy != "hold" else Reaction(str(reaction))
    flight.watching = False
    flight.event("hold", f"{after} ({after.policy})", level="warning")
    return _drop(flight, after) if after.policy == "stop_motors" else after


def _over_the_pads(flight: Flight, names: Collection[str]) -> bool:
    """Everybody to over his pad, along ways planned from where all are now; False if there are none."""
    if strays := flight.strays():
        flight.event("return", f"nobody flies back past {', '.join(strays)}, who cannot be told to", level="warning")
        return False
    try:
        passage = _planned(flight, ways_home, names)
    except TransferError as error:
        flight.event("return", f"nobody flies back: {error}", level="warning")
        return False
    flight.event("return", f"{len(passage)} fly back to their pads", level="warning")
    if refused := fly(flight, passage):
        flight.event("return", refused, level="warning")
        return False
    flight.wait(_CALM)
    return True


def _step_aside(flight: Flight, names: Collection[str]) -> None:
    """Everybody who has an obstacle or another drone below to where they can land, if there is such a place."""
    try:
        passage = _planned(flight, clear_descents, names)
    except TransferError as error:
        flight.event("step_aside", str(error), level="warning")
        return
    if passage:
        flight.event("step_aside", f"not straight down: {', '.join(passage)}", level="warning")
        if refused := fly(flight, passage):
            flight.event("step_aside", refused, level="warning")
        flight.wait(_CALM)


def _planned(flight: Flight, planner: Planner, names: Collection[str]) -> Passage:
    """Ways of these, as far as it is known where they are, from where everybody is. Raises TransferError."""
    positions = {name: position for name in flight.fleet if (position := flight.position(name)) is not None}
    able = [name for name in names if name in positions]
    return flight.aside(lambda: planner(flight.plan.mission, positions, able))
