"""To the search and back: take off, fly the moves of the plan by their schedule, settle.

The moves are those of the certificate, given when it says: the high-level commander flies each as the polynomial
that was certified, and robots that move together are told back to back.
"""

from __future__ import annotations

import itertools
import math

from deploy.errors import DeployError, FlightAborted
from deploy.flight.commands import command, refusals
from deploy.flight.loop import Flight, Vec3
from deploy.flight.reference import Way
from deploy.phases import Phase
from deploy.radio import highlevel
from planner.transfers import Move, Passage, Transfers, duration

AT_ALTITUDE = 0.15  # m
AT_PLACE = 0.10  # m
AHEAD = 0.05  # rad from the x axis, along which drones are put on their pads: less needs no turn
_STEEPEST = 2.1875  # rate of the commander's polynomial at its fastest, over its mean (planner.c, degree 7)
_NUDGE = 0.6  # s after which a take-off that was accepted but not begun is given once more
_BLINK = 0.2  # s, longer than the supervisor's blink


def take_off(flight: Flight) -> None:
    """Everybody up to the height of their trajectory's start, straight over their pads.

    Raises:
        FlightAborted: somebody refused, or did not rise.
    """
    flight.enter(Phase.TAKING_OFF)
    flight.watching = True
    moves = {name: flown[0] for name, flown in _transfers(flight).take_off.items()}
    commands = {name: highlevel.takeoff(move.target[2], move.duration) for name, move in moves.items()}
    given = flight.clock.now()
    flight.courses.ways |= {name: _way(flight, name, move) for name, move in moves.items()}
    require(flight, "take-off", command(flight, commands))
    flight.wait(_NUDGE)
    # In the supervisor's blink on the ground a command may be accepted and yet dropped (protocol notes B1, B3).
    words = {n: d.status.supervisor for n, d in flight.fleet.items() if d.status and d.status.t > given + _BLINK}
    idle = [name for name, word in words.items() if not word.planner_active]
    if idle:
        flight.event("repeat", f"take-off accepted but not begun, repeated: {', '.join(idle)}", level="warning")
        command(flight, {name: commands[name] for name in idle})
    flight.wait(max(move.duration for move in moves.values()) - _NUDGE)

    def low() -> list[str]:
        return [name for name, move in moves.items() if distance(flight, name, None, move.target[2]) > AT_ALTITUDE]

    if not flight.wait_until(lambda: not low(), flight.left):
        raise FlightAborted(f"did not reach the altitude: {', '.join(low())}")


def transfer(flight: Flight) -> None:
    """Everybody to the start of their trajectory, and turned to where it looks first.

    Raises:
        FlightAborted: somebody refused.
    """
    flight.enter(Phase.TRANSFERRING)
    passage = {**_transfers(flight).approach, **_turns(flight)}
    flight.allow(duration(passage))
    refused = fly(flight, passage)
    if refused:
        raise FlightAborted(f"transfer: {refused}")


def settle(flight: Flight) -> None:
    """Hover at the starts until everybody is where their trajectory begins.

    Raises:
        FlightAborted: somebody is not there in time.
    """
    flight.enter(Phase.SETTLING)
    flight.wait(flight.plan.mission.flight.settle_time)

    def away() -> list[str]:
        return [n for n in flight.fleet if distance(flight, n, flight.courses.start(n), None) > AT_PLACE]

    if not flight.wait_until(lambda: not away(), flight.left):
        raise FlightAborted(f"more than {AT_PLACE * 100:.0f} cm from the start of the trajectory: {', '.join(away())}")


def go_back(flight: Flight) -> None:
    """Everybody to above where they land, and still there.

    The moves count on everybody's being where the search ended: they are flown together or not at all.

    Raises:
        FlightAborted: somebody cannot be told, or refused.
    """
    flight.enter(Phase.RETURNING)
    passage = _transfers(flight).back
    if not passage:
        return
    if silent := [name for name in flight.fleet if name not in flight.where.alive]:
        raise FlightAborted(f"nobody flies back past {', '.join(silent)}, who cannot be told to")
    if refused := fly(flight, passage):
        raise FlightAborted(f"return: {refused}")
    places = {name: moves[-1].target for name, moves in passage.items()}

    def away() -> list[str]:
        return [name for name, place in places.items() if distance(flight, name, place, None) > AT_PLACE]

    if not flight.wait_until(lambda: not away(), flight.left):
        flight.event("return", f"not where they should land: {', '.join(away())}", level="warning")


def fly(flight: Flight, passage: Passage) -> str:
    """Give the moves of a passage when they are due and let them end; returns who refused one, if anybody did."""
    begun = flight.clock.now()
    orders = sorted((move.begin, name, move) for name, moves in passage.items() for move in moves)
    for begin, due in itertools.groupby(orders, key=lambda order: order[0]):
        flight.wait(begun + begin - flight.clock.now())
        moves = {name: move for _, name, move in due}
        flight.courses.ways |= {name: _way(flight, name, move) for name, move in moves.items()}
        commands = {
            name: highlevel.go_to(move.target, flight.courses.yaw_at_start(name), move.duration)
            for name, move in moves.items()
        }
        if refused := refusals(command(flight, commands)):
            return refused
    flight.wait(begun + duration(passage) - flight.clock.now())
    return ""


def _turns(flight: Flight) -> Passage:
    """Turns on the spot of those who are there already: take-off keeps a heading, and only moves change it."""
    moved, rate = _transfers(flight).approach, flight.plan.mission.trajectory.yaw_rate
    turns: dict[str, tuple[Move, ...]] = {}
    for name in flight.fleet:
        turn = abs(math.remainder(flight.courses.yaw_at_start(name), 2.0 * math.pi))
        if turn > AHEAD and not moved.get(name):
            turns[name] = (Move(flight.courses.start(name), 0.0, _STEEPEST * turn / rate),)
    return turns


def require(flight: Flight, what: str, codes: dict[str, int | None]) -> None:
    """Raise FlightAborted unless everybody accepted a command."""
    if refused := refusals(codes):
        raise FlightAborted(f"{what}: {refused}")


def distance(flight: Flight, name: str, point: Vec3 | None, height: float | None) -> float:
    """From a point, or only from a height [m]; inf if nobody knows where the drone is."""
    position = flight.where.position(name)
    if position is None:
        return math.inf
    return math.dist(position, point) if point is not None else abs(position[2] - (height or 0.0))


def _way(flight: Flight, name: str, move: Move) -> Way:
    """A move that begins now; where it begins is where the last one ended, or where the drone stands."""
    now = flight.clock.now()
    origin = flight.courses.at(name, now) or flight.where.position(name) or move.target
    return Way(origin, move.target, now, move.duration)


def _transfers(flight: Flight) -> Transfers:
    if flight.plan.transfers is None:
        raise DeployError("the plan has no moves to the search and back")  # pre-flight checks refuse it before this
    return flight.plan.transfers
