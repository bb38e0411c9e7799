"""On the ground: connect, set up, settle the estimators, check, upload, arm; each for some drones, failures by drone.

Who is tried again and who is left behind is decided in ``muster.py``.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import TypeAlias

from deploy.errors import CommandRefused, DeployError
from deploy.flight.lights import ring_parameters
from deploy.flight.loop import Flight
from deploy.flight.poses import heading
from deploy.flight.records import Ready
from deploy.flight.watch import tilt
from deploy.preflight import SETTLED_DEVIATION, DroneFacts, PreflightCheck, check_drone
from deploy.radio.drone import Drone
from deploy.radio.memory import TRAJECTORY
from deploy.upload import upload
from missions.decks import DECKS, DeckName
from missions.schema import Mission

_CONTROLLERS = {"pid": 1, "mellinger": 2}
_KALMAN = 2
# How far the filter may be off by its own account, as standard deviations.
_SETTLED_POSITION, _SETTLED_VELOCITY = SETTLED_DEVIATION, 0.2  # m, m/s
_SETTLED_AGREEMENT = 0.03  # m, between estimate and motion capture; the pre-flight check allows a little more
_SETTLED_FOR = 1.0  # s
_CONNECTED_WITHIN = 60.0  # s of wall time, tables of contents and all
Names: TypeAlias = Collection[str]
Failures: TypeAlias = dict[str, DeployError]


def parameters_of(mission: Mission, external: bool) -> dict[str, float]:
    """On-board parameters a mission sets, in order; the mission's own last, so that they win.

    Args:
        mission: the mission.
        external: whether motion capture positions the drones; then its deviations are Crazyswarm2's.
    """
    parameters = {
        "stabilizer.controller": float(_CONTROLLERS[mission.flight.controller]),
        "stabilizer.estimator": float(_KALMAN),
    }
    if external:
        parameters |= {"locSrv.extPosStdDev": 1e-3, "locSrv.extQuatStdDev": 0.05}
    return parameters | {name: float(value) for name, value in mission.flight.parameters.items()}


def connect(flight: Flight, names: Names) -> Failures:
    """Open links, set and read back the parameters, start telemetry."""
    mission = flight.plan.mission
    wanted = parameters_of(mission, flight.poses.external)

    def set_up(drone: Drone) -> Ready:
        drone.connect(_CONNECTED_WITHIN)
        lights = ring_parameters(mission, drone.name)
        shown = {name: value for name, value in lights.items() if drone.has_parameter(name)}  # else: older firmware
        held = {name: drone.set_parameter(name, value) for name, value in (shown | wanted).items()}
        drone.start_telemetry(mission.flight.log_rate)
        try:
            memory = drone.memory(TRAJECTORY).size
        except CommandRefused:
            memory = 0
        return Ready(drone.firmware(), memory, decks(drone), held)

    ready, failures = flight.fleet.attempt(set_up, flight.tick, among=names, within=flight.left)
    flight.ready |= ready
    return failures


def decks(drone: Drone) -> tuple[DeckName, ...] | None:
    """Decks a drone has found, by its own word; None if its firmware knows of none. Raises LinkError."""
    known = {deck: kind.parameter for deck, kind in DECKS.items() if drone.has_parameter(kind.parameter)}
    return tuple(deck for deck, parameter in known.items() if drone.read_parameter(parameter)) if known else None


def settle_estimators(flight: Flight, names: Names) -> Failures:
    """Reset every filter to where motion capture sees its drone, and wait until it believes that.

    A filter that does not settle is not an error here: the pre-flight checks say what is wrong with which drone.
    """
    flight.wait_until(lambda: all(flight.poses.located(name) for name in names), 2.0)

    def reset(drone: Drone) -> None:
        drone.resume_telemetry("variance")
        located = flight.poses.located(drone.name) if flight.poses.external else None
        if located is not None:
            x, y, z = located.pose.position
            initial = {"X": x, "Y": y, "Z": z, "Yaw": heading(located.pose)}
            for axis, value in initial.items():
                drone.set_parameter(f"kalman.initial{axis}", value)
        # The estimator task clears the parameter itself, so it cannot be compared with what was written.
        drone.set_parameter("kalman.resetEstimation", 1, compare=False)
        drone.set_parameter("kalman.resetEstimation", 0, compare=False)

    _, failures = flight.fleet.attempt(reset, flight.tick, among=names, within=flight.left)
    asked = flight.clock.now()
    unsettled = {name: asked for name in names if name not in failures}

    def settled() -> bool:
        now = flight.clock.now()
        for name in unsettled:
            if flight.fleet[name].connected and not _settled(flight, name, asked):
                unsettled[name] = now
        return all(now - since >= _SETTLED_FOR for since in unsettled.values())

    if flight.wait_until(settled, flight.left):
        flight.event("estimators", "settled", value=flight.clock.now() - asked)
    else:
        late = [name for name, since in unsettled.items() if flight.clock.now() - since < _SETTLED_FOR]
        flight.event("estimators", f"not settled: {', '.join(late)}", level="warning")
    for name in unsettled:
        flight.fleet[name].stop_telemetry("variance")  # nobody looks at it in the air
    return failures


def judge(flight: Flight, name: str) -> tuple[PreflightCheck, ...]:
    """The pre-flight checks of one drone."""
    return check_drone(flight.plan, _facts(flight, name), flight.poses.external)


def load(flight: Flight, names: Names) -> Failures:
    """Certified bytes into these drones, read back."""

    def act(drone: Drone) -> None:
        upload(drone, flight.plan.trajectories[drone.name])

    return flight.fleet.attempt(act, flight.tick, among=names, within=flight.left)[1]


def arm(flight: Flight) -> dict[str, str]:
    """Arm those that do not arm themselves and wait until all are ready; returns who is not, and why.

    An auto-arming drone that waits on the ground is not ready for 0.15 s every 30 s (supervisor.prefltTimeout), so
    readiness is waited for, not just looked at.
    """
    for drone in flight.fleet.values():
        if drone.connected and drone.status is not None and not drone.status.supervisor.arms_itself:
            drone.request_arming(True)
    asked, allowance = flight.clock.now(), flight.left

    def waiting() -> list[str]:
        # A word from before says nothing: who was restarted since has forgotten telemetry and trajectory alike.
        return [
            name
            for name, drone in flight.fleet.items()
            if not (drone.connected and drone.status and drone.status.t > asked and drone.status.supervisor.ready)
        ]

    flight.wait_until(lambda: not waiting(), allowance)
    reasons = {}
    for name in waiting():
        drone = flight.fleet[name]
        state = drone.status.supervisor if drone.status and drone.status.t > asked else "nothing heard of it"
        reasons[name] = drone.link.lost or f"not ready to fly within {allowance:.0f} s: {state}"
    return reasons


def disarm(flight: Flight, names: Names) -> None:
    """Make sure that the propellers of these stay still: disarm those that do not arm themselves."""
    for name in names:
        drone = flight.fleet[name]
        if drone.connected and drone.status is not None and not drone.status.supervisor.arms_itself:
            drone.request_arming(False)


def _settled(flight: Flight, name: str, asked: float) -> bool:
    drone, located = flight.fleet[name], flight.poses.located(name)
    variance, estimate = drone.variance, drone.estimate
    if variance is None or estimate is None or min(variance.t, estimate.t) <= asked:
        return False
    if max(variance.position) > _SETTLED_POSITION**2 or max(variance.velocity) > _SETTLED_VELOCITY**2:
        return False
    if not flight.poses.external:
        return True
    return located is not None and math.dist(located.pose.position, estimate.position) <= _SETTLED_AGREEMENT


def _facts(flight: Flight, name: str) -> DroneFacts:
    drone, located, ready = flight.fleet[name], flight.poses.located(name), flight.ready[name]
    status, estimate, variance = drone.status, drone.estimate, drone.variance
    roll, pitch = estimate.rpy[:2] if estimate else (math.nan, math.nan)
    external = flight.poses.external and located is not None
    return DroneFacts(
        robot=name,
        protocol=drone.protocol,
        firmware=ready.firmware,
        memory=ready.memory,
        link=drone.link,
        supervisor=status.supervisor if status else None,
        voltage=status.voltage if status else math.nan,
        pose=located.pose.position if external and located else None,
        pose_age=flight.clock.now() - located.t if located else math.inf,
        estimate=estimate.position if estimate else None,
        tilt=tilt(roll, pitch) if estimate else math.nan,
        parameters=ready.parameters,
        decks=ready.decks,
        deviation=math.sqrt(max(variance.position)) if variance else math.nan,
    )
