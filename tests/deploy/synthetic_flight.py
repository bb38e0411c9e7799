"""Flight plans and flight logs made by hand, for tests of everything that happens after a flight."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from deploy.flightlog.writer import FlightLog
from deploy.planfile import plan_bytes
from missions.arrays import Array
from missions.loader import parse_mission
from missions.schema import Mission
from planner.certificate.record import Certificate, Check
from planner.flightplan import FlightPlan
from planner.indicators import indicators
from planner.plan import Plan
from planner.trajectory.encode import decode, encode
from planner.trajectory.piecewise import PiecewisePolynomial

TAKEOFF, SETTLE = 3.0, 2.0
EPOCH = 1_767_225_600.0


def mission(
    duration: float = 12.0,
    robots: int = 4,
    name: str = "synthetic",
    description: str = "four drones",
    footprint: str = "null",
) -> Mission:
    """A 3 by 2.5 m search with two obstacles."""
    drones = "\n".join(f"  - {{name: cf{i + 1}, start: [{0.5 + 0.7 * i}, 0.3]}}" for i in range(robots))
    text = f"""schema_version: 1
name: {name}
description: {description!r}
workspace: {{lower: [0.0, 0.0], upper: [3.0, 2.5]}}
horizon: {{duration: {duration}, dt: 0.1}}
footprint: {footprint}
information:
  type: gaussians
  components:
    - {{mean: [1.0, 0.8], covariance: 0.03}}
    - {{mean: [2.0, 1.7], covariance: 0.03}}
connectivity: {{policy: probabilistic, range: 0.8, sub_periods: 3, threshold: 0.1}}
limits: {{acceleration: 1.0, separation: 0.3}}
obstacles:
  - {{type: circle, center: [1.55, 1.3], radius: 0.1}}
robots:
{drones}
"""
    return parse_mission(text, path="synthetic.yaml", read_file=lambda name: b"")


def trajectory(start: Array, duration: float, number: int) -> PiecewisePolynomial:
    """Rest to rest: up and back with a bow, quintic pieces."""
    pieces = 4
    T = duration / pieces
    goals = start[:2] + np.array([(0.0, 0.0), (0.1, 1.2), (0.25, 0.7), (0.1, 1.9), (0.15, 0.9)])
    quintic = np.array([0, 0, 0, 10 / T**3, -15 / T**4, 6 / T**5, 0, 0])
    c = np.zeros((pieces, 4, 8))
    for m in range(pieces):
        for axis in range(2):
            c[m, axis] = quintic * (goals[m + 1][axis] - goals[m][axis])
            c[m, axis, 0] += goals[m][axis]
        c[m, 2, 0] = 0.6
    return PiecewisePolynomial(np.full(pieces, T), c)


def flight_plan(passed: bool = True, asked: Mission | None = None, **options: object) -> FlightPlan:
    """A plan with a certificate that binds it, whatever it says."""
    asked = mission(**options) if asked is None else asked
    starts = [np.array(robot.start) for robot in asked.robots]
    flown = [trajectory(start, asked.horizon.duration, i) for i, start in enumerate(starts)]
    encoded = {robot.name: encode(p, asked.trajectory) for robot, p in zip(asked.robots, flown, strict=True)}
    t = np.arange(asked.steps + 1) * asked.horizon.dt
    q = np.stack([p.evaluate(t)[:, : asked.dimension] for p in flown], axis=1)
    v = np.stack([p.evaluate(t, 1)[:, : asked.dimension] for p in flown], axis=1)
    found = indicators(asked, t, q)
    plan = Plan(t, q, v, np.diff(v, axis=0) / asked.horizon.dt, found.ergodicity, 0.0, seed=7)
    checks = (
        Check("separation", found.smallest_separation, 0.3, "m", ">=", passed, "cf1–cf2", 4.0),
        Check("speed", 0.8, 1.0, "m/s", "<=", True, "cf3", 2.5),
    )
    hashes = tuple((name, item.sha256) for name, item in encoded.items())
    assert asked.source is not None
    certificate = Certificate(checks, found, asked.source.sha256, hashes)
    return FlightPlan(asked, plan, encoded, certificate, {"ergoflie": "0.1.0", "numpy": "2"})


def write_flight(
    path: Path,
    flown: FlightPlan | None = None,
    *,
    lag: float = 0.07,
    noise: float = 0.003,
    fault: str = "",
    metadata: dict[str, str] | None = None,
) -> FlightPlan:
    """Write a flight log: take-off, search with a lag and noise, landing.

    ``fault``: "" for none; "drift" pulls cf2 away; "battery" empties cf3; "link" loses packets of cf1;
    "gap" hides cf4 from the motion capture for 1.5 s.
    """
    flown = flown or flight_plan()
    rng = np.random.default_rng(3)
    asked = flown.mission
    paths = {name: decode(item) for name, item in flown.trajectories.items()}
    duration = asked.horizon.duration
    begin = TAKEOFF + SETTLE
    end = begin + duration
    final = end + SETTLE + TAKEOFF
    log = FlightLog(
        path, EPOCH, {"plan.mcap": plan_bytes(flown)}, metadata or {"backend": "simulated", "seed": "0"}, "wait"
    )
    phases = {0.0: "airborne", TAKEOFF: "transferring", begin: "on_mission", end: "returning", end + SETTLE: "landing"}
    steps = np.arange(round(final * 50) + 1)
    tracks = {name: _track(path_, steps / 50, (begin, end, final), lag) for name, path_ in paths.items()}
    if fault == "drift":
        away = np.clip((steps / 50 - begin) / (end - begin), 0.0, 1.0)
        tracks["cf2"][0][:, 0] += 0.35 * np.sin(away * math.pi) ** 2
    with log:
        log.event(0.0, "preflight", "battery of cf1 4.1 V", robot="cf1", value=4.1)
        for name in tracks:
            text = "parameters: stabilizer.controller = 2, commander.enHighLevel = 1 (allowed: read back as set)"
            log.event(0.0, "preflight", text, robot=name)
        for step in steps.tolist():
            t = step / 50
            for at, phase in phases.items():
                if abs(at - t) < 1e-9:
                    log.event(t, "phase", phase.replace("_", " "), phase=phase)
                    names = {begin: "mission_start", end: "mission_end"}
                    if at in names:
                        log.event(t, names[at], "all trajectories", phase=phase)
            if fault == "drift" and abs(t - begin - 6.0) < 1e-9:
                log.event(t, "tracking", "cf2 is 0.31 m off its trajectory", robot="cf2", level="fault", value=0.31)
            for number, (name, (truth, asked_for)) in enumerate(tracks.items()):
                if not (fault == "gap" and name == "cf4" and 3.0 < t - begin < 4.5):
                    log.pose(name, t, truth[step] + noise * rng.standard_normal(3), (0.0, 0.0, 0.0, 1.0))
                if step % 5 == 0:
                    _telemetry(log, rng, name, number, t, (begin, end, final), truth[step], asked_for[step], fault)
        log.event(final, "phase", "landed", phase="landed")
    return flown


def _track(path_, t, times, lag) -> tuple[Array, Array]:
    """Where a robot is and where it is asked to be, (S, 3) each."""
    begin, _, final = times

    def place(at: Array) -> Array:
        p = path_.evaluate(at - begin)[:, :3].copy()
        p[:, 2] *= np.clip(np.minimum(t / TAKEOFF, (final - t) / TAKEOFF), 0.0, 1.0)
        return p

    return place(t - lag), place(t)


def _telemetry(log, rng, name, number, t, times, truth, asked_for, fault) -> None:
    begin, end, final = times
    step = round(t * 50)
    log.estimate(name, t, truth, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), tick=step * 20)
    log.setpoint(name, t, asked_for)
    if begin <= t <= end:
        log.reference(name, t, asked_for)
    drain = 1.1 if fault == "battery" and name == "cf3" else 0.35
    low = 3 if fault == "battery" and name == "cf3" and t > end else 0
    log.battery(name, t, 4.05 - drain * t / final - (0.12 if 0.1 < t < final else 0.0), level=80.0, state=low)
    log.motors(name, t, [round(65535 * share) for share in (0.61, 0.6, 0.59, 0.62)] if 0.1 < t < final else [0] * 4)
    lost = step // 20 if fault == "link" and name == "cf1" else 0
    sent = {"sent": step * 3, "received": step * 3 - lost, "lost": lost}
    log.link(name, t, latency_ms=4.0 + rng.exponential(2.0), quality=100.0 - lost / 10, rssi=-45.0 - 5 * number, **sent)
    flying = 0.02 < t < final - 0.02
    log.supervisor(name, t, 0x1E if flying else 0x0E, ["can_fly", *(["flying"] if flying else [])])
