"""In the air: start together, search, land. Ways there and back: passages.py; coming down early: abort.py."""

from __future__ import annotations

import statistics
from collections.abc import Mapping

import numpy as np

from deploy.flight.legs import Chains
from deploy.flight.loop import RETRY, Flight
from deploy.flight.passages import require
from deploy.flight.replanning import Replanning
from deploy.flight.separations import SEPARATION_SLACK
from deploy.flight.timing import heard
from deploy.flight.touchdown import land_latecomers, land_together, put_to_rest
from deploy.phases import Phase
from deploy.radio import highlevel
from deploy.radio.requests import Reply
from deploy.radio.supervisor import Supervisor
from deploy.upload import trajectory_id
from missions import fleet

_START_PATIENCE = 0.3  # s; by then a trajectory from rest has moved less than a millimetre at our accelerations
_SAMPLES = 0.05  # s between looks at a late start; nobody moves more than a few centimetres in it


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
    first = {name: flight.plan.trajectories[name].legs[0] for name in flight.fleet}
    replies = {
        name: drone.send(highlevel.start_trajectory(trajectory_id(0, first[name])))
        for name, drone in flight.fleet.items()
    }
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
        flight.courses.search.start,
        Phase.ON_MISSION,
        "mission_start",
        "all trajectories started",
        value=flight.courses.search.skew,
    )
    flight.event(
        "start_skew", f"starts within {flight.courses.search.skew * 1000:.1f} ms", value=flight.courses.search.skew
    )


def _begin(flight: Flight, instants: Mapping[str, float]) -> None:
    """The search has begun: at these instants by robot, and on average where one is not known."""
    flight.courses.search.start = statistics.fmean(instants.values())
    flight.courses.search.skew = max(instants.values()) - min(instants.values())
    for name, timeline in flight.courses.timelines.items():
        # Who has one leg is compared with everybody's mean start; legs are started by it, and timed one by one.
        timeline.restart(
            instants.get(name, flight.courses.search.start) if timeline.legs > 1 else flight.courses.search.start
        )


def search(flight: Flight) -> None:
    """Follow the trajectories to their end, leg by leg, then hover; plan anew as maps change. Raises FlightAborted."""
    end, chains = flight.courses.search.start + flight.courses.duration, Chains(flight)
    replanning = Replanning(flight, chains)
    while flight.clock.now() < end - 1e-9:
        flight.tick()
        chains.turn()
        replanning.turn()
    flight.event("mission_end", "all trajectories ended")
    flight.enter(Phase.HOLDING)
    flight.wait(flight.plan.mission.flight.settle_time)


def land(flight: Flight) -> dict[str, bool]:
    """Everybody straight down, together, from where they hover. Returns who was seen on the ground, motors off."""
    flight.enter(Phase.LANDING)
    down = land_together(flight, flight.where.alive)
    landed = put_to_rest(flight, down | land_latecomers(flight, down))
    flight.enter(Phase.LANDED if all(landed.values()) else Phase.ABORTED)
    return landed


# ---------------------------------------------------------------------------------------------------- inside


def _chase(flight: Flight, silent: list[str], replies: dict[str, Reply]) -> list[str]:
    """Ask those that did not answer the start what they do; repeat it to those that hover. Returns who flies it."""
    asked = {name: flight.fleet[name].request_supervisor() for name in silent}
    flight.wait_until(lambda: all(asked[name].here or replies[name].here for name in silent), RETRY)
    moving, repeated = [], []
    for name in silent:
        late = flight.clock.now() - replies[name].sent
        flies = _manoeuvres(asked[name])
        if replies[name].here:  # meanwhile: its code says the rest
            text = f"start answered only {late * 1000:.0f} ms after it was given"
        elif flies:
            moving.append(name)
            text = "start not answered, but it flies"
        elif flies is None:
            text = "start not answered, and it does not say whether it flies: not repeated"
        elif jump := too_late(flight, name, late):
            text = f"start not answered; it hovers; not repeated {late * 1000:.0f} ms late: {jump}"
        else:
            repeated.append(name)
            text = f"start not answered; it hovers; repeated once, {late * 1000:.0f} ms late"
            flight.fleet[name].resend(replies[name])
        flight.event("repeat", text, robot=name, level="warning", value=late)
    if repeated:
        flight.wait_until(lambda: all(replies[name].here for name in repeated), _START_PATIENCE - 2 * RETRY)
    return moving


def _manoeuvres(reply: Reply) -> bool | None:
    """Whether a drone flies something, by its answer to the question; None without one."""
    return Supervisor(int.from_bytes(reply.payload[1:3], "little")).manoeuvring if reply.here else None


def too_late(flight: Flight, name: str, late: float) -> str:
    """What a start this late [s] would lead to; empty if everybody stays as far apart, and it as near to its plan."""
    mission = flight.plan.mission
    t = np.arange(0.0, flight.courses.duration + late, _SAMPLES)
    on_time = flight.courses.references[name].evaluate(t)[:, :3]
    behind = flight.courses.references[name].evaluate(np.maximum(t - late, 0.0))[:, :3]
    off = float(np.linalg.norm(behind - on_time, axis=1).max())
    if off > mission.flight.tracking_limit / 2.0:
        return f"it would be up to {off:.2f} m behind its trajectory"
    scale = np.array([1.0, 1.0, fleet.vertical_scale(mission)])
    for other, reference in flight.courses.references.items():
        apart = float(np.linalg.norm((behind - reference.evaluate(t)[:, :3]) * scale, axis=1).min())
        if other != name and apart < mission.limits.separation - SEPARATION_SLACK:
            return f"it would come within {apart:.2f} m of {other}"
    return ""
