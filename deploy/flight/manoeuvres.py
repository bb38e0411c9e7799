"""In the air: start together, search, land; and how everybody comes down early. Ways there and back: passages.py."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Collection, Iterable, Mapping

import numpy as np

from deploy.flight.legs import Chains
from deploy.flight.loop import RETRY, Flight, Vec3
from deploy.flight.passages import fly, require
from deploy.flight.reactions import Reaction
from deploy.flight.timing import heard
from deploy.flight.watch import SEPARATION_SLACK
from deploy.phases import TABLE, Phase
from deploy.radio import highlevel
from deploy.radio.requests import Reply
from deploy.radio.supervisor import Supervisor
from deploy.upload import trajectory_id
from missions import fleet
from missions.schema import Mission
from planner.transfer.descent import clear_descents, ways_home
from planner.transfer.errors import TransferError
from planner.transfers import Passage

Planner = Callable[[Mission, Mapping[str, Vec3], Collection[str]], Passage]

GROUND_CLEARANCE = 0.03  # m above the pads' height: where the motors stop
OFF_THE_GROUND = 0.10  # m above the pad
_START_PATIENCE = 0.3  # s; by then a trajectory from rest has moved less than a millimetre at our accelerations
_SAMPLES = 0.05  # s between looks at a late start; nobody moves more than a few centimetres in it
_ON_PLAN = 0.15  # m between reference and telemetered setpoint
_BRAKE = 1.0  # m/s², mean deceleration of an abort
_SHORTEST_BRAKE, _LONGEST_BRAKE = 0.6, 2.0  # s
_DISARMING = 1.0  # s; a drone that stays armed keeps its propellers dangerous, but the flight is over
_CALM = 0.5  # s of hover between braking and landing


def start_together(flight: Flight) -> None:
    """Start all trajectories, back to back, in world coordinates; measure how far apart the starts are.

    A drone that refuses, or does not fly although it accepted, brings everybody down: nobody flies a plan whose
    meetings and distances count on somebody who is not there. A start that is not answered is repeated once, only if
    the drone says that it still hovers (else it would jump back), and only if a flight so late stays near the plan and
    clear of the others.

    Raises:
        FlightAborted: somebody did not start.
    """
    flight.enter(Phase.ON_MISSION)
    command = highlevel.start_trajectory(trajectory_id(0))
    replies = {name: drone.send(command) for name, drone in flight.fleet.items()}
    sent = [reply.sent for reply in replies.values()]
    _begin(flight, dict.fromkeys(replies, statistics.fmean(sent)))
    flight.wait_until(lambda: all(reply.here for reply in replies.values()), RETRY)
    silent = [name for name, reply in replies.items() if not reply.here]
    moving = _chase(flight, silent, replies) if silent else []
    for name, reply in replies.items():
        flight.timing.answered(name, reply)
    codes = {n: highlevel.return_code(r.payload) if r.here else None for n, r in replies.items() if n not in moving}
    require(flight, "trajectory start", codes)
    latency = flight.plan.mission.radio.latency
    answered = {name: heard(reply, latency) for name, reply in replies.items() if reply.arrived is not None}
    _begin(flight, answered or {name: reply.sent for name, reply in replies.items()})
    flight.journal.event(
        flight.search.start, Phase.ON_MISSION, "mission_start", "all trajectories started", value=flight.search.skew
    )
    flight.event("start_skew", f"starts within {flight.search.skew * 1000:.1f} ms", value=flight.search.skew)


def _begin(flight: Flight, instants: Mapping[str, float]) -> None:
    """The search has begun: at these instants by robot, and on average where one is not known."""
    flight.search.start = statistics.fmean(instants.values())
    flight.search.skew = max(instants.values()) - min(instants.values())
    for name, timeline in flight.timelines.items():
        # Who has one leg is compared with everybody's mean start; legs are started by it, and timed one by one.
        timeline.restart(instants.get(name, flight.search.start) if timeline.legs > 1 else flight.search.start)


def search(flight: Flight) -> None:
    """Follow the trajectories to their end, leg by leg, then hover. Raises FlightAborted."""
    end, chains = flight.search.start + flight.duration, Chains(flight)
    while flight.clock.now() < end - 1e-9:
        flight.tick()
        chains.turn()
    flight.event("mission_end", "all trajectories ended")
    flight.enter(Phase.HOLDING)
    flight.wait(flight.plan.mission.flight.settle_time)


def land(flight: Flight) -> dict[str, bool]:
    """Everybody straight down, together, from where they hover. Returns who was seen on the ground, motors off."""
    flight.enter(Phase.LANDING)
    landed = _descend(flight, flight.alive)
    if all(landed.values()):
        flight.enter(Phase.LANDED)
    else:
        flight.enter(Phase.ABORTED)
    return landed


def abort(flight: Flight, reaction: Reaction) -> dict[str, bool]:
    """Bring down those in the air, the way the reaction says; returns who is down.

    Landing from motion would stop with a jerk (the commander plans landings from rest), so everybody brakes first.
    Braking together from certified motion, over less than the distance that two drones keep, needs no new plan.
    """
    flight.watching = False
    searching = flight.phases.now in (Phase.ON_MISSION, Phase.HOLDING) and flight.search.begun
    if flight.phases.now is not Phase.LANDING:
        flight.enter(Phase.ABORTING)
    flight.event("abort", f"{reaction} ({reaction.policy})", level="fault")
    if reaction.policy == "stop_motors":
        _drop(flight, reaction.robots)
    flying = [name for name in flight.alive if _height(flight, name) > OFF_THE_GROUND]
    grounded = [name for name in flight.alive if name not in flying]
    flight.command({name: highlevel.stop() for name in grounded}, patience=0.3)
    if flying and flight.phases.now is Phase.ABORTING:
        _brake(flight, flying, searching, reaction.since)
        if reaction.policy == "hold":
            reaction = _hold(flight)
        if not (reaction.policy == "return" and _over_the_pads(flight, flying)):
            _step_aside(flight, flying)
    landed = _descend(flight, flight.alive)
    flight.enter(Phase.ABORTED)
    return landed


def stop_motors(flight: Flight) -> None:
    """The operator's second word: motors off, in whatever height."""
    _cut_motors(flight, flight.fleet)
    flight.watching = False
    flight.enter(Phase.EMERGENCY)
    flight.event("emergency", "the operator stopped the motors", level="fault")
    flight.wait(0.5)


# ---------------------------------------------------------------------------------------------------- inside


def _height(flight: Flight, name: str) -> float:
    position = flight.position(name)
    return math.inf if position is None else position[2] - flight.ground


def _chase(flight: Flight, silent: list[str], replies: dict[str, Reply]) -> list[str]:
    """Ask those that did not answer the start what they do; repeat it to those that hover. Returns who flies it."""
    asked = {name: flight.fleet[name].request_supervisor() for name in silent}
    flight.wait_until(lambda: all(reply.here for reply in asked.values()), RETRY)
    words = {n: Supervisor(int.from_bytes(r.payload[1:3], "little")) for n, r in asked.items() if r.here}
    moving = [name for name, word in words.items() if word.manoeuvring]
    for name in silent:
        late = flight.clock.now() - replies[name].sent
        if name in moving:
            text = "start not answered, but it flies"
        elif name not in words:
            text = "start not answered, and nobody knows whether it flies: not repeated"
        elif jump := too_late(flight, name, late):
            text = f"start not answered, and not repeated {late * 1000:.0f} ms late: {jump}"
        else:
            text = "start not answered, repeated once"
            flight.fleet[name].resend(replies[name])
        flight.event("repeat", text, robot=name, level="warning")
    flight.wait_until(
        lambda: all(replies[name].here for name in silent if name not in moving), _START_PATIENCE - 2 * RETRY
    )
    return moving


def too_late(flight: Flight, name: str, late: float) -> str:
    """What a start this late [s] would lead to; empty if everybody stays as far apart, and it as near to its plan."""
    mission = flight.plan.mission
    t = np.arange(0.0, flight.duration + late, _SAMPLES)
    on_time = flight.references[name].evaluate(t)[:, :3]
    behind = flight.references[name].evaluate(np.maximum(t - late, 0.0))[:, :3]
    off = float(np.linalg.norm(behind - on_time, axis=1).max())
    if off > mission.flight.tracking_limit / 2.0:
        return f"it would be up to {off:.2f} m behind its trajectory"
    scale = np.array([1.0, 1.0, fleet.vertical_scale(mission)])
    for other, reference in flight.references.items():
        apart = float(np.linalg.norm((behind - reference.evaluate(t)[:, :3]) * scale, axis=1).min())
        if other != name and apart < mission.limits.separation - SEPARATION_SLACK:
            return f"it would come within {apart:.2f} m of {other}"
    return ""


def _brake(flight: Flight, names: Iterable[str], searching: bool, since: float) -> None:
    """Everybody to a stop in the same time, along their own motion; measures how long after ``since`` they heard."""
    motions = {name: _motion(flight, name, searching) for name in names}
    fastest = max((math.hypot(*velocity) for _, velocity, _ in motions.values()), default=0.0)
    duration = min(_LONGEST_BRAKE, max(_SHORTEST_BRAKE, fastest / _BRAKE))
    commands = {}
    for name, (position, velocity, yaw) in motions.items():
        # From speed v to rest in T, a smooth profile covers v T / 2.
        x, y, z = (p + 0.5 * duration * v for p, v in zip(position, velocity, strict=True))
        commands[name] = highlevel.go_to((x, y, max(z, flight.ground + OFF_THE_GROUND)), yaw, duration)
    if refused := flight.refusals(flight.command(commands, patience=0.5)):
        flight.event("brake", refused, level="warning")
    if not math.isnan(since):
        flight.timing.reaction = taken = flight.clock.now() - since
        text = f"everybody told to brake {taken * 1000:.0f} ms after the first sign"
        flight.event("reaction", text, value=taken)
    flight.wait(duration + _CALM)


def _drop(flight: Flight, names: Iterable[str]) -> None:
    """Stop the motors of these."""
    names = dict.fromkeys(names)
    _cut_motors(flight, names)
    for name in names:
        flight.event("emergency", "motors stopped by the mission's policy", robot=name, level="fault")


def _cut_motors(flight: Flight, names: Iterable[str]) -> None:
    for _ in range(3):  # nobody answers this packet
        for name in names:
            flight.fleet[name].emergency_stop()


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
    if after.policy == "stop_motors":
        _drop(flight, after.robots)
    return after


def _over_the_pads(flight: Flight, names: Collection[str]) -> bool:
    """Everybody to over his pad, along ways planned from where all are now; False if there are none."""
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


def _motion(flight: Flight, name: str, searching: bool) -> tuple[Vec3, Vec3, float]:
    """Position and velocity of what the commander asks for now, and the heading: where a new move begins."""
    target, estimate, now = flight.fleet[name].target, flight.fleet[name].estimate, flight.clock.now()
    yaw = estimate.rpy[2] if estimate else 0.0
    if searching:
        reference = flight.reference_at(name, now)
        # Telemetry is a little old, the reference is not; but a drone may be flying something else.
        if target is None or math.dist(target.position, reference) <= _ON_PLAN:
            return reference, flight.velocity_reference(name, now), yaw
    if target is not None:
        return target.position, target.velocity, yaw
    return flight.position(name) or flight.start_of(name), (0.0, 0.0, 0.0), yaw


def _descend(flight: Flight, names: Iterable[str]) -> dict[str, bool]:
    """Land these together; returns for every drone of the fleet whether it is known to be down."""
    flight.watching = False
    duration = flight.plan.mission.flight.landing_duration
    names = list(names)
    airborne = [name for name in names if _height(flight, name) > OFF_THE_GROUND or _flies(flight, name)]
    commands = {name: highlevel.land(flight.ground + GROUND_CLEARANCE, duration) for name in airborne}
    if refused := flight.refusals(flight.command(commands)):
        flight.event("landing", refused, level="fault")
    begun = flight.clock.now()
    flight.wait(duration)

    def up() -> list[str]:
        return [n for n in flight.alive if n in names and _flies(flight, n, since=begun + duration)]

    flight.wait_until(lambda: not up(), TABLE[Phase.LANDING].allowance)
    landed = {name: name in flight.alive and not _flies(flight, name, since=begun) for name in flight.fleet}
    for name, down in landed.items():
        if not down:
            flight.fault("landing", name, "nobody knows whether it is on the ground")
    _put_to_rest(flight, [name for name in names if landed[name]])
    return landed


def _put_to_rest(flight: Flight, names: Iterable[str]) -> None:
    """Stop the planners of drones on the ground, and disarm those that were armed by us."""
    drones = {name: flight.fleet[name] for name in names}
    flight.command({name: highlevel.stop() for name in drones}, patience=0.3)
    ours = [d for d in drones.values() if d.status is not None and not d.status.supervisor.arms_itself]
    for drone in ours:
        drone.request_arming(False)
    flight.wait_until(
        lambda: not any(d.status and d.status.supervisor.armed for d in ours), _DISARMING if ours else 0.0
    )


def _flies(flight: Flight, name: str, since: float = -math.inf) -> bool:
    """Whether a drone flies by its newest word; True if that word is older than ``since``."""
    status = flight.fleet[name].status
    return status is None or status.t < since or status.supervisor.flying
