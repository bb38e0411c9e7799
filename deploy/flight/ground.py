"""On the ground: connect, set up, settle the estimators, check, upload, arm."""

from __future__ import annotations

import math
from collections.abc import Mapping

from deploy.errors import CommandRefused, FlightAborted
from deploy.flight.loop import Flight
from deploy.flight.poses import heading
from deploy.phases import TABLE, Phase
from deploy.preflight import DroneFacts, PreflightReport, check_fleet, check_log, check_plan
from deploy.radio.drone import Drone
from deploy.radio.memory import TRAJECTORY
from deploy.upload import upload
from missions.schema import Mission

_CONTROLLERS = {"pid": 1, "mellinger": 2}
_KALMAN = 2
# How far the filter may be off by its own account, as standard deviations.
_SETTLED_POSITION, _SETTLED_VELOCITY = 0.05, 0.2  # m, m/s
_SETTLED_AGREEMENT = 0.03  # m, between estimate and motion capture; the pre-flight check allows a little more
_SETTLED_FOR = 1.0  # s


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


def connect(flight: Flight) -> Mapping[str, Mapping[str, float]]:
    """Open all links, set and read back the parameters, start telemetry. Returns what each drone holds.

    Raises:
        FleetError: with what failed on which drone.
    """
    mission = flight.plan.mission
    flight.fleet.each("connecting", Drone.connect, flight.tick)
    wanted = parameters_of(mission, flight.poses.external)

    def set_up(drone: Drone) -> dict[str, float]:
        held = {name: drone.set_parameter(name, value) for name, value in wanted.items()}
        drone.start_telemetry(mission.flight.log_rate)
        return held

    held = flight.fleet.each("setting up", set_up, flight.tick)
    flight.enter(Phase.CONNECTED)
    return held


def settle_estimators(flight: Flight) -> None:
    """Reset every filter to where motion capture sees its drone, and wait until it believes that.

    A filter that does not settle is not an error here: the pre-flight checks say what is wrong with which drone.

    Raises:
        FleetError: a drone did not take the reset.
    """
    flight.wait_until(lambda: all(flight.poses.located(name) for name in flight.fleet), 2.0)

    def reset(drone: Drone) -> None:
        located = flight.poses.located(drone.name) if flight.poses.external else None
        if located is not None:
            x, y, z = located.pose.position
            initial = {"X": x, "Y": y, "Z": z, "Yaw": heading(located.pose)}
            for axis, value in initial.items():
                drone.set_parameter(f"kalman.initial{axis}", value)
        # The estimator task clears the parameter itself, so it cannot be compared with what was written.
        drone.set_parameter("kalman.resetEstimation", 1, compare=False)
        drone.set_parameter("kalman.resetEstimation", 0, compare=False)

    flight.fleet.each("resetting the estimator", reset, flight.tick)
    asked = flight.clock.now()
    unsettled = dict.fromkeys(flight.fleet, asked)

    def settled() -> bool:
        now = flight.clock.now()
        for name in flight.fleet:
            if not _settled(flight, name, asked):
                unsettled[name] = now
        return all(now - since >= _SETTLED_FOR for since in unsettled.values())

    if flight.wait_until(settled, TABLE[Phase.CONNECTED].allowance):
        flight.event("estimators", "settled", value=flight.clock.now() - asked)
    else:
        late = [name for name, since in unsettled.items() if flight.clock.now() - since < _SETTLED_FOR]
        flight.event("estimators", f"not settled: {', '.join(late)}", level="warning")


def check(flight: Flight, parameters: Mapping[str, Mapping[str, float]]) -> PreflightReport:
    """Make all pre-flight checks and write every one of them to the log.

    Raises:
        PreflightError: with every failure. FleetError: a drone stopped answering.
    """
    facts = flight.fleet.each("asking for versions", _versions, flight.tick)
    drones = [_facts(flight, name, facts[name], parameters[name]) for name in flight.fleet]
    checks = (
        *check_plan(flight.plan),
        check_log(flight.journal.log.failure),
        *check_fleet(flight.plan, drones, flight.poses.external),
    )
    report = PreflightReport(checks)
    for item in checks:
        level = {"pass": "info", "warning": "warning", "failure": "fault"}[item.result]
        text = f"{item.name}: {item.value} (allowed: {item.limit})"
        if item.remedy:
            text += f"; {item.remedy}"
        flight.event("preflight", text, robot=item.robot, level=level)  # type: ignore[arg-type]
    report.require()
    flight.enter(Phase.CHECKED)
    return report


def upload_all(flight: Flight) -> None:
    """Certified bytes into every drone, read back. Raises FleetError."""
    trajectories = flight.plan.trajectories
    flight.fleet.each("uploading", lambda drone: upload(drone, trajectories[drone.name]), flight.tick)
    flight.event("upload", "all trajectories read back equal", value=float(sum(t.size for t in trajectories.values())))
    flight.enter(Phase.UPLOADED)


def arm(flight: Flight) -> None:
    """Arm those that do not arm themselves and wait until all are ready.

    An auto-arming drone that waits on the ground is not ready for 0.15 s every 30 s (supervisor.prefltTimeout), so
    readiness is waited for, not just looked at.

    Raises:
        FlightAborted: somebody did not get ready.
    """
    for drone in flight.fleet.values():
        if drone.status is not None and not drone.status.supervisor.arms_itself:
            drone.request_arming(True)

    def waiting() -> list[str]:
        return [name for name, drone in flight.fleet.items() if not (drone.status and drone.status.supervisor.ready)]

    asked = flight.clock.now()
    flight.wait_until(lambda: all(d.status and d.status.t > asked for d in flight.fleet.values()), 1.0)
    if not flight.wait_until(lambda: not waiting(), TABLE[Phase.UPLOADED].allowance):
        states = "; ".join(
            f"{name}: {drone.status.supervisor if drone.status else 'unknown'}"
            for name, drone in flight.fleet.items()
            if name in waiting()
        )
        raise FlightAborted(f"not ready to fly within {TABLE[Phase.UPLOADED].allowance:.0f} s: {states}")
    flight.enter(Phase.ARMED)


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


def _versions(drone: Drone) -> tuple[str, int]:
    try:
        memory = drone.memory(TRAJECTORY).size
    except CommandRefused:
        memory = 0
    return drone.firmware(), memory


def _facts(flight: Flight, name: str, versions: tuple[str, int], held: Mapping[str, float]) -> DroneFacts:
    drone, located = flight.fleet[name], flight.poses.located(name)
    status, estimate = drone.status, drone.estimate
    roll, pitch = estimate.rpy[:2] if estimate else (math.nan, math.nan)
    external = flight.poses.external and located is not None
    return DroneFacts(
        robot=name,
        protocol=drone.protocol,
        firmware=versions[0],
        memory=versions[1],
        link=drone.link,
        supervisor=status.supervisor if status else None,
        voltage=status.voltage if status else math.nan,
        pose=located.pose.position if external and located else None,
        pose_age=flight.clock.now() - located.t if located else math.inf,
        estimate=estimate.position if estimate else None,
        tilt=math.acos(max(-1.0, min(1.0, math.cos(roll) * math.cos(pitch)))) if estimate else math.nan,
        parameters=held,
    )
