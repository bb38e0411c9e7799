"""``python -m tests.benchmarks.trajectories [--seeds N]``: from plans to certified bytes.

Rows are random smooth curves in three dimensions, which need no solver, some of them for three minutes, and every
shipped mission, planned with each seed. Pieces, legs and bytes are the largest of any drone; the deviation is that of
the decoded bytes from the plan at the same time. CPU seconds of this process.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from missions.loader import load_mission, parse_mission
from missions.schema import Mission
from planner.certificate.certify import certify
from planner.errors import PlannerError
from planner.pipeline import make_flight_plan
from planner.plan import Plan
from planner.trajectory.encode import decode, encode
from planner.trajectory.fit import deviation, fit

ASK = "asked for 30 s of flight: fit <= 50 ms a drone, certificate <= 1 s for 10 drones"
HEADER = (
    f"{'plan':28s} {'drones':>6s} {'flight s':>8s} {'pieces':>6s} {'legs':>4s} {'bytes':>6s} {'deviation mm':>12s} "
    f"{'fit ms/drone':>12s} {'certificate s':>13s}  result"
)
SHIPPED = ("*.yaml", "policies/*.yaml", "examples/*.yaml")
CURVES = ((10, 30.0, 6), (50, 30.0, 1), (2, 180.0, 1))  # drones, seconds, seeds
TIME_LIMIT = 600.0  # [s] of clock: a busy machine must not change the table
CELL = 2.0  # [m] between the centres of random curves
REACH = 0.6  # [m] how far they go along an axis
WAVES = 4  # sine waves an axis,
PERIODS = (2.5, 10.0)  # [s] of them


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    name: str
    drones: int
    seconds: float
    pieces: int
    legs: int
    size: int
    deviation: float
    fit: float
    certificate: float
    result: str

    def __str__(self) -> str:
        return (
            f"{self.name:28s} {self.drones:6d} {self.seconds:8.0f} {self.pieces:6d} {self.legs:4d} {self.size:6d} "
            f"{1e3 * self.deviation:12.2f} {1e3 * self.fit:12.1f} {self.certificate:13.2f}  {self.result}"
        )


def shipped(seed: int) -> Iterator[tuple[str, Mission, Plan | None, str]]:
    """Every mission that is shipped, planned; None and why not if there is no plan."""
    folder = Path("missions")
    for path in sorted(path for pattern in SHIPPED for path in folder.glob(pattern)):
        if path.name == "airframes.yaml":
            continue
        mission = load_mission(path)
        settings = dataclasses.replace(mission.solver, seed=seed, time_limit=TIME_LIMIT)
        mission = dataclasses.replace(mission, solver=settings)
        try:
            yield f"{path.stem} {seed}", mission, make_flight_plan(mission).plan, ""
        except PlannerError as error:
            yield f"{path.stem} {seed}", mission, None, str(error)


def random_curves(drones: int, seconds: float, seed: int) -> tuple[Mission, Plan]:
    """A plan of smooth curves, rest to rest, each in a cube of its own."""
    rng = np.random.default_rng(seed)
    side, dt = math.ceil(math.sqrt(drones)), 0.1
    steps = round(seconds / dt)
    t = dt * np.arange(steps + 1)
    centres = np.array([(1.0 + CELL * (i % side), 1.0 + CELL * (i // side), 1.0) for i in range(drones)])
    rates = 2.0 * np.pi / rng.uniform(*PERIODS, (WAVES, drones, 3))
    phases = rng.uniform(0.0, 2.0 * np.pi, (WAVES, drones, 3))
    waves = np.sin(rates[None] * t[:, None, None, None] + phases).mean(axis=1)  # (T+1, N, 3)
    window = np.sin(np.pi * t / seconds) ** 4  # rest to rest, without jerk at the ends
    curve = centres + REACH * window[:, None, None] * waves
    v = np.gradient(curve, dt, axis=0, edge_order=2)
    v[[0, -1]] = 0.0
    u = np.diff(v, axis=0) / dt
    q = np.concatenate([curve[:1], curve[0] + np.cumsum(dt * v[:-1] + 0.5 * dt**2 * u, axis=0)])
    text = {
        "schema_version": 1,
        "name": "random_curves",
        "workspace": {"lower": [0.0, 0.0, 0.2], "upper": [CELL * side, CELL * side, 2.0]},
        "horizon": {"duration": seconds, "dt": dt},
        "information": {"type": "uniform"},
        "basis": {"functions_per_axis": 4},
        "robots": [
            {"name": f"cf{i + 1}", "start": start, "uri": f"radio://{i // 3}/80/2M/E7E7E7E7{i:02X}"}
            for i, start in enumerate(q[0].tolist())
        ],
        "limits": {"acceleration": 2.0, "speed": 1.5, "separation": 0.3},
    }
    mission = parse_mission(json.dumps(text), path="random_curves.yaml", read_file={}.__getitem__)
    return mission, Plan(t, q, v, u, 0.0, 0.0)


def measure(name: str, mission: Mission, plan: Plan) -> Row:
    """Fit, encode and certify one plan."""
    names, seconds = [robot.name for robot in mission.robots], mission.horizon.duration
    begin = time.process_time()
    pieces = fit(plan, mission)
    fitted = time.process_time() - begin
    bytes_ = {robot: encode(one, mission.trajectory) for robot, one in zip(names, pieces, strict=True)}
    begin = time.process_time()
    certificate = certify(mission, bytes_)
    certified = time.process_time() - begin
    error = max(deviation(plan, k, decode(bytes_[robot]))[0] for k, robot in enumerate(names))
    failures = ", ".join(f"{check.name} {check.margin:.3g} {check.unit}" for check in certificate.failures)
    warnings = ", ".join(check.name for check in certificate.warnings)
    result = f"fails: {failures}" if failures else f"passes; warns of {warnings}" if warnings else "passes"
    return Row(
        name,
        len(names),
        seconds,
        max(item.pieces for item in bytes_.values()),
        max(len(item.legs) for item in bytes_.values()),
        max(item.size for item in bytes_.values()),
        error,
        fitted / len(names),
        certified,
        result,
    )


def run(seeds: int = 1) -> None:
    """Print the table."""
    print(ASK)
    print(HEADER)
    for drones, seconds, count in CURVES:
        for seed in range(count):
            mission, plan = random_curves(drones, seconds, seed)
            _print(f"random curves {seed}", mission, plan, "")
    for seed in range(seeds):
        for name, mission, found, why in shipped(seed):
            _print(name, mission, found, why)


def _print(name: str, mission: Mission, plan: Plan | None, why: str) -> None:
    try:
        line = str(measure(name, mission, plan)) if plan else f"{name:28s} {len(mission.robots):6d}  no plan: {why}"
    except PlannerError as error:
        line = f"{name:28s} {len(mission.robots):6d}  {error}"
    print(line, flush=True)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.trajectories", description=__doc__)
    parser.add_argument(
        "--seeds", type=int, default=1, help="seeds of the solver for every shipped mission (default 1)"
    )
    run(parser.parse_args().seeds)


if __name__ == "__main__":
    main()
