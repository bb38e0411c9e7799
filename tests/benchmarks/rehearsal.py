"""``python -m tests.benchmarks.rehearsal [COUNT …]``: what a rehearsal costs, from connection to landing.

One process, cflib, flight log and all checks included: simulated seconds per CPU second against the number of drones.
Planning is not in it: the drones fly one smooth piece each, side by side.
"""

from __future__ import annotations

import argparse
import json
import math
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deploy.rehearsal import rehearse
from missions.loader import parse_mission
from planner.certificate.certify import certify
from planner.flightplan import FlightPlan
from planner.plan import Plan
from planner.trajectory.encode import decode, encode
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.transfer.plan import plan_transfers

COUNTS = (1, 4, 10, 50)
DURATION = 30.0  # s of search
SPACING = 0.8  # m between neighbours
SHIFT = 0.5  # m everybody moves, along x
ASKED = {10: 20.0, 50: 2.0}  # issue 5: times real time on one core
# Rest to rest with zero acceleration and jerk at both ends: 35 s⁴ − 84 s⁵ + 70 s⁶ − 20 s⁷.
_SMOOTH = np.array([0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0]) * DURATION ** -np.arange(8.0)


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    drones: int
    simulated: float
    cpu: float
    ended: str

    def __str__(self) -> str:
        asked = f"{ASKED[self.drones]:.0f} ×" if self.drones in ASKED else ""
        speed = self.simulated / self.cpu
        return f"{self.drones:6d} {self.simulated:12.1f} {self.cpu:8.1f} {speed:12.1f} ×   {asked:>5s}   {self.ended}"


HEADER = f"{'drones':>6s} {'simulated s':>12s} {'CPU s':>8s} {'real time':>14s}   {'asked':>5s}   ended"


def flight_plan(count: int) -> FlightPlan:
    """Drones on a square grid, all of which move the same way at the same time."""
    side = math.ceil(math.sqrt(count))
    starts = [(0.5 + SPACING * (i % side), 0.5 + SPACING * (i // side)) for i in range(count)]
    size = 1.0 + SPACING * side + SHIFT
    text = {
        "schema_version": 1,
        "name": f"rehearsal_of_{count}",
        "workspace": {"lower": [0.0, 0.0], "upper": [size, size]},
        "horizon": {"duration": DURATION, "dt": 0.1},
        "information": {"type": "gaussians", "components": [{"mean": [0.5 * size, 0.5 * size], "covariance": 0.1}]},
        "robots": [{"name": f"cf{i + 1}", "start": list(start)} for i, start in enumerate(starts)],
        "limits": {"acceleration": 1.0, "speed": 1.0, "separation": 0.3},
    }
    mission = parse_mission(json.dumps(text), path="rehearsal.yaml", read_file={}.__getitem__)
    trajectories = {robot.name: encode(_move(robot.start, mission.flight.altitude)) for robot in mission.robots}
    t = np.linspace(0.0, DURATION, round(DURATION / 0.1) + 1)
    q = np.zeros((len(t), count, 2))
    plan = Plan(t, q, q.copy(), np.zeros((len(t) - 1, count, 2)), 0.0, 0.0)
    transfers = plan_transfers(mission, {name: decode(item) for name, item in trajectories.items()})
    certificate = certify(mission, trajectories, transfers)
    return FlightPlan(mission, plan, trajectories, certificate, {"ergoflie": "benchmark"}, transfers)


def measure(count: int) -> Row:
    """Rehearse one flight."""
    plan = flight_plan(count)
    with tempfile.TemporaryDirectory() as folder:
        start = time.process_time()
        outcome, _ = rehearse(plan, log_path=Path(folder) / "flight.mcap")
        cpu = time.process_time() - start
    return Row(count, outcome.duration, cpu, f"{outcome.phase.value} {outcome.reason}".strip())


def run(counts: tuple[int, ...] = COUNTS) -> None:
    """Print the table."""
    print(HEADER)
    for count in counts:
        print(measure(count), flush=True)


def _move(start: tuple[float, ...], altitude: float) -> PiecewisePolynomial:
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, 0] = SHIFT * _SMOOTH
    coefficients[0, 0, 0], coefficients[0, 1, 0], coefficients[0, 2, 0] = *start[:2], altitude
    return PiecewisePolynomial(np.array([DURATION]), coefficients)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.rehearsal", description=__doc__)
    parser.add_argument("counts", type=int, nargs="*", default=list(COUNTS), metavar="COUNT", help="drones")
    run(tuple(parser.parse_args().counts))


if __name__ == "__main__":
    main()
