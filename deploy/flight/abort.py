"""How a flight ends early: everybody brakes together, then what the mission's policy or the operator says.

Nothing here begins before everybody has stopped, and everybody stops where nobody meets anybody (``stops.py``). Then
they land in turn (``landing.py``), fly home along ways planned from where all are, or wait.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from functools import partial

from deploy.flight.braking import CALM, brake, halt
from deploy.flight.commands import command
from deploy.flight.deadlines import Overdue
from deploy.flight.landing import may_fall, with_those_below
from deploy.flight.loop import Flight, Vec3
from deploy.flight.passages import fly
from deploy.flight.reactions import Reaction
from deploy.flight.stops import LONGEST
from deploy.flight.touchdown import OFF_THE_GROUND, height, land_in_turn, land_latecomers, land_together, put_to_rest
from deploy.phases import Phase
from deploy.radio import highlevel
from missions.safety import Policy
from missions.schema import Mission
from planner.transfer.descent import clear_descents, ways_home
from planner.transfer.errors import TransferError
from planner.transfers import Passage, duration

Planner = Callable[[Mission, Mapping[str, Vec3], Collection[str]], Passage]

_LONGEST_FALL = 2.0  # s: from 20 m


def abort(flight: Flight, reaction: Reaction) -> dict[str, bool]:
    """Bring down those in the air, the way the reaction says or a stronger one that becomes due; returns who is down.

    Landing from motion would stop with a jerk (the commander plans landings from rest), so everybody brakes first.
    """
    flight.watching = False
    if flight.phases.now not in (Phase.LANDING, Phase.ABORTING):  # ABORTING: a bug on the way down
        flight.enter(Phase.ABORTING)
    flight.allow(LONGEST)
    flight.event("abort", f"{reaction} ({reaction.policy})", level="fault")
    flight.doing, flight.on_worse = reaction, partial(_drop, flight)
    _drop(flight, reaction)
    try:
        down = _come_down(flight)
        down |= land_latecomers(flight, down)
    except Overdue as late:
        down = _down_at_once(flight, late)
    landed = put_to_rest(flight, down)
    flight.enter(Phase.ABORTED)
    return landed


def stop_motors(flight: Flight) -> None:
    """The operator's second word: motors off, in whatever height."""
    _cut_motors(flight, flight.fleet)
    flight.watching = False
    flight.enter(Phase.EMERGENCY)
    flight.event("emergency", "the operator stopped the motors", level="fault")
    # To the ground: the log is to show where they fell.
    flight.wait_until(lambda: all(height(flight, n) < OFF_THE_GROUND for n in flight.where.alive), _LONGEST_FALL)
    flight.wait(CALM)


# ---------------------------------------------------------------------------------------------------- the sequence


def _come_down(flight: Flight) -> dict[str, bool]:
    """Everybody to the ground; who is known to be there."""
    alive = flight.where.alive
    flying = [name for name in alive if height(flight, name) > OFF_THE_GROUND]
    grounded = [name for name in alive if name not in flying]
    command(flight, {name: highlevel.stop() for name in grounded}, patience=0.3)
    down: dict[str, bool] = {}
    if flying and flight.phases.now is Phase.ABORTING:
        down = _stopped(flight, flying)
    return down | land_in_turn(flight, [name for name in flight.where.alive if name not in down])


def _down_at_once(flight: Flight, late: Overdue) -> dict[str, bool]:
    """Everybody straight down from wherever he is, whatever was to come before; who is known to be there."""
    flight.watching = False
    flight.event("abort", f"{late}: everybody lands where he is", level="fault")
    try:
        return land_together(flight, flight.where.alive)
    except Overdue as again:
        flight.event("abort", str(again), level="fault")
        return {}


def _stopped(flight: Flight, flying: Collection[str]) -> dict[str, bool]:
    """Brake, wait, land some, fly home, as what is under way says; then everybody hovers where he can land.

    Returns:
        Who has landed on the way, and whether that is known.
    """
    down: dict[str, bool] = {}
    brake(flight, flying, flight.doing.since if flight.doing else math.nan)
    flight.on_return = lambda name: halt(flight, name)
    if _is_due(flight, "hold"):
        _hold(flight)
    while True:
        up = [name for name in flight.where.alive if name in flying and name not in down]
        if _is_due(flight, "land_here") and (first := _first(flight, up)):
            down |= _land_first(flight, first, up)
            continue  # somebody else may have to land, or everybody, by now
        if not up or not _is_due(flight, "return", "land_here"):
            break
        try:
            if _over_the_pads(flight, up):
                return down
            break
        except Overdue:
            raise
        except Reaction:  # ``flight.doing`` by now
            brake(flight, up, math.nan)
    if up:
        _step_aside(flight, up)
    return down


def _is_due(flight: Flight, *policies: Policy) -> bool:
    return flight.doing is not None and flight.doing.policy in policies


# ---------------------------------------------------------------------------------------------------- then


def _drop(flight: Flight, reaction: Reaction) -> None:
    """Stop the motors a reaction says, if nobody is below; who has somebody below lands like everybody."""
    if reaction.policy != "stop_motors":
        return
    separation, positions = flight.plan.mission.limits.separation, flight.where.positions()
    for name in dict.fromkeys(reaction.robots):
        estimate = flight.fleet[name].estimate
        velocity = estimate.velocity if estimate else (0.0, 0.0, 0.0)
        if name in positions and not may_fall(name, positions, velocity, separation):
            text = "its motors are not stopped: it would fall onto another drone; it lands"
            flight.event("emergency", text, robot=name, level="fault")
            continue
        _cut_motors(flight, [name])
        flight.event("emergency", "motors stopped by the mission's policy", robot=name, level="fault")


def _cut_motors(flight: Flight, names: Iterable[str]) -> None:
    for _ in range(3):  # nobody answers this packet
        for name in names:
            flight.fleet[name].emergency_stop()


def _first(flight: Flight, up: Collection[str]) -> tuple[str, ...]:
    """Those in the air whom ``land_here`` means, and whoever is below them."""
    positions = flight.where.positions()
    hovering = {name: positions[name] for name in up if name in positions}
    concerned = flight.doing.robots if flight.doing else ()
    return with_those_below(concerned, hovering, flight.plan.mission.limits.separation)


def _land_first(flight: Flight, first: Collection[str], up: Collection[str]) -> dict[str, bool]:
    """These on the spot; the others wait. Who is known to be down."""
    if waiting := [name for name in up if name not in first]:
        flight.event("landing", f"{', '.join(first)} first; {', '.join(waiting)} wait", level="warning")
    _step_aside(flight, first)
    return dict.fromkeys(first, False) | land_in_turn(flight, first)


def _hold(flight: Flight) -> None:
    """Everybody hovers where he stopped; then ``flight.doing`` is how it goes on from here: never in a hover."""
    safety, operator = flight.plan.mission.safety, flight.operator
    flight.event("hold", f"everybody hovers, for at most {safety.hold_time:g} s", level="warning")
    flight.allow(safety.hold_time)
    flight.watching = True
    try:
        called = flight.wait_until(operator.return_requested, safety.hold_time)
        flight.doing = Reaction("the hover is over", "return" if called else "land_all")
    except Overdue:
        raise
    except Reaction as worse:
        flight.doing = worse
    finally:
        flight.watching = False
    flight.event("hold", f"{flight.doing} ({flight.doing.policy})", level="warning")


def _over_the_pads(flight: Flight, names: Collection[str]) -> bool:
    """Everybody to over his pad, along ways planned from where all are now; False if there are none.

    Raises:
        Reaction: something stronger is due, and ``flight.doing`` by now.
    """
    if strays := flight.where.strays():
        flight.event("return", f"nobody flies back past {', '.join(strays)}, who cannot be told to", level="warning")
        return False
    flight.watching = True
    try:
        passage = _planned(flight, ways_home, names)
        flight.event("return", f"{len(passage)} fly back to their pads", level="warning")
        flight.allow(duration(passage) + CALM)
        if refused := fly(flight, passage):
            flight.event("return", refused, level="warning")
            return False
        flight.wait(CALM)
    except TransferError as error:
        flight.event("return", f"nobody flies back: {error}", level="warning")
        return False
    finally:
        flight.watching = False
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
        flight.allow(duration(passage) + CALM)
        if refused := fly(flight, passage):
            flight.event("step_aside", refused, level="warning")
        flight.wait(CALM)


def _planned(flight: Flight, planner: Planner, names: Collection[str]) -> Passage:
    """Ways of these, as far as it is known where they are, from where everybody is. Raises TransferError."""
    positions = flight.where.positions()
    flight.allow(0.0)
    able = [name for name in names if name in positions]
    return flight.aside(lambda: planner(flight.plan.mission, positions, able))
