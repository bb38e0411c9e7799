"""Down to the ground: everybody together where that is certified, else in turn; and off."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np

from deploy.flight.commands import command, refusals
from deploy.flight.landing import landing_waves
from deploy.flight.loop import Flight
from deploy.flight.stops import LONGEST, Space
from deploy.phases import Phase
from deploy.radio import highlevel

GROUND_CLEARANCE = 0.03  # m above the pads' height: where the motors stop
OFF_THE_GROUND = 0.10  # m above the pad
_DISARMING = 1.0  # s; a drone that stays armed keeps its propellers dangerous, but the flight is over
_LATECOMERS = 6.0  # s
_WORD = 0.5  # s: until telemetry says whether it flies
_LOOKS = 20  # at where a drone that cannot be told will be while another one lands


def height(flight: Flight, name: str) -> float:
    """Above the pads [m]; inf if nobody knows."""
    position = flight.where.position(name)
    return math.inf if position is None else position[2] - flight.where.ground


def flies(flight: Flight, name: str, since: float = -math.inf) -> bool:
    """Whether a drone flies by its newest word; True if that word is older than ``since`` [s]."""
    status = flight.fleet[name].status
    return status is None or status.t < since or status.supervisor.flying


def land_together(flight: Flight, names: Iterable[str]) -> dict[str, bool]:
    """These straight down at once; by robot, whether it is known to be down since."""
    flight.watching = False
    names, begun = list(names), flight.clock.now()
    airborne = [name for name in names if height(flight, name) > OFF_THE_GROUND or flies(flight, name)]
    times = {name: _landing_time(flight, name) for name in airborne}
    longest = max(times.values(), default=0.0)
    flight.allow(longest, like=Phase.LANDING)
    commands = {name: highlevel.land(flight.where.ground + GROUND_CLEARANCE, times[name]) for name in airborne}
    if refused := refusals(command(flight, commands)):
        flight.event("landing", refused, level="fault")
    told = flight.clock.now()
    flight.wait(longest)

    def up() -> list[str]:
        return [n for n in flight.where.alive if n in names and flies(flight, n, since=told + longest)]

    flight.wait_until(lambda: not up(), flight.left)
    down = {name: name in flight.where.alive and not flies(flight, name, since=begun) for name in names}
    flight.lookout.down |= {name for name in names if down[name]}
    return down


def land_in_turn(flight: Flight, names: Iterable[str]) -> dict[str, bool]:
    """These as ``landing.py`` orders them, and nobody into the way of one who flies on and cannot be told.

    Returns:
        By robot, whether it is known to be down.
    """
    left, space = list(names), Space.of(flight.plan.mission, flight.where.ground)
    down: dict[str, bool] = {}
    patience = flight.plan.mission.safety.hold_time
    flight.allow(patience)
    end = flight.clock.now() + patience
    while left:
        hovering = {name: flight.where.position(name) or (math.nan, math.nan, math.inf) for name in left}
        turn = landing_waves(hovering, space.separation)[0]
        clear = [name for name in turn if not _is_passed(flight, name, space)]
        if not clear and flight.clock.now() < end:
            flight.tick()
            continue
        now = clear or list(turn)
        left = [name for name in left if name not in now]
        if left:
            flight.event("landing", f"{', '.join(now)} first; {', '.join(left)} wait")
        down |= land_together(flight, now)
    return down


def land_latecomers(flight: Flight, down: Mapping[str, bool]) -> dict[str, bool]:
    """Give lost links a while when everybody else is down; who is back and flies lands. Who is known to be down.

    ``flight.on_return`` has told them to stop already, if that was needed.
    """
    known = {name: True for name, landed in down.items() if landed}
    flight.allow(_LATECOMERS + LONGEST)
    end = flight.clock.now() + _LATECOMERS
    while len(known) < len(flight.fleet) and flight.clock.now() < end:
        flight.tick()
        if back := [name for name in flight.where.alive if name not in known]:
            flight.wait(LONGEST if any(height(flight, name) > OFF_THE_GROUND for name in back) else _WORD)
            known |= {name: True for name, landed in land_in_turn(flight, back).items() if landed}
    return known


def put_to_rest(flight: Flight, down: Mapping[str, bool]) -> dict[str, bool]:
    """The end of a flight: what is down is switched off; who is not known to be is a fault. By robot, who is down."""
    flight.allow(_DISARMING)
    landed = {name: down.get(name, False) for name in flight.fleet}
    for name in landed:
        if not landed[name]:
            flight.fault("landing", name, "nobody knows whether it is on the ground")
    drones = {name: flight.fleet[name] for name in landed if landed[name]}
    command(flight, {name: highlevel.stop() for name in drones}, patience=0.3)
    ours = [d for d in drones.values() if d.status is not None and not d.status.supervisor.arms_itself]
    for drone in ours:
        drone.request_arming(False)
    flight.wait_until(
        lambda: not any(d.status and d.status.supervisor.armed for d in ours), _DISARMING if ours else 0.0
    )
    return landed


# ---------------------------------------------------------------------------------------------------- inside


def _landing_time(flight: Flight, name: str) -> float:
    """As the mission says from the height of the search; longer from higher up [s]."""
    share = height(flight, name) / max(flight.courses.start(name)[2] - flight.where.ground, OFF_THE_GROUND)
    return flight.plan.mission.flight.landing_duration * (max(1.0, share) if math.isfinite(share) else 1.0)


def _is_passed(flight: Flight, name: str, space: Space) -> bool:
    """Whether somebody who cannot be told comes onto a drone's way down while it lands."""
    here = flight.where.position(name)
    if here is None:
        return False
    looks = np.linspace(0.0, _landing_time(flight, name), _LOOKS).tolist()
    return any(
        math.dist(place[:2], here[:2]) < space.separation and place[2] < here[2] + OFF_THE_GROUND
        for later in flight.where.strays().values()
        for place in map(later, looks)
    )
