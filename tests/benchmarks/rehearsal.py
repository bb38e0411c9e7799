"""``python -m tests.benchmarks.rehearsal [COUNT …]``: what a rehearsal costs, from connection to landing.

Simulated seconds per CPU second against the number of drones; cflib, flight log and all checks included, tables of
contents cached as in every flight but the first. Each row is a process of its own. Planning is not in it: the drones
fly one smooth piece each, side by side. The column ``cflib alone`` is what no rehearsal can exceed here, see
``cflib_alone.py``. CPU seconds depend on the machine and on who else uses it: the last line says how fast it was
meanwhile.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from deploy.radio.drone import Drone
from deploy.radio.fleet import Fleet
from deploy.radio.simulated.air.model import AirModel
from deploy.rehearsal import Stage, rehearse
from missions.loader import parse_mission
from planner.certificate.certify import certify
from planner.flightplan import FlightPlan
from planner.plan import Plan
from planner.trajectory.encode import decode, encode
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.transfer.plan import plan_transfers
from tests.benchmarks import cflib_alone
from tests.benchmarks.memory import most_memory

COUNTS = (1, 4, 10, 30, 50)
DURATION = 30.0  # s of search
SPACING = 0.8  # m between neighbours
PER_DONGLE = 5  # drones that share one radio
SHIFT = 0.5  # m everybody moves, along x
ASKED = {10: 20.0, 50: 2.0}  # issue 5: times real time on one core
# Rest to rest with zero acceleration and jerk at both ends: 35 s⁴ − 84 s⁵ + 70 s⁶ − 20 s⁷.
_SMOOTH = np.array([0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0]) * DURATION ** -np.arange(8.0)


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes:
        simulated: flight seconds. cpu: CPU seconds that they took; alone: those of cflib for one of them.
        cold, cached: to connect, in CPU and in flight seconds. memory: MB a drone.
    """

    drones: int
    simulated: float
    cpu: float
    alone: float
    cold: tuple[float, float]
    cached: tuple[float, float]
    memory: float
    ended: str

    def __str__(self) -> str:
        asked = f"{ASKED[self.drones]:.0f} ×" if self.drones in ASKED else ""
        return (
            f"{self.drones:6d} {self.simulated:12.1f} {self.cpu:8.1f} {self.simulated / self.cpu:12.1f} × {asked:>6s} "
            f"{1.0 / self.alone:9.0f} × "
            f"{self.cold[0]:8.2f} {self.cold[1]:6.1f} {self.cached[0]:8.2f} {self.cached[1]:6.1f} {self.memory:9.1f}   "
            f"{self.ended}"
        )


HEADER = (
    f"{'':39s} {'asked':>9s} {'cflib':>11s} {'connect cold':>15s} {'cached':>15s} {'MB per':>9s}\n"
    f"{'drones':>6s} {'simulated s':>12s} {'CPU s':>8s} {'real time':>14s} {'':>6s} {'alone':>11s} "
    f"{'CPU s':>8s} {'radio':>6s} {'CPU s':>8s} {'radio':>6s} {'drone':>9s}   ended"
)


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
        "robots": [
            {"name": f"cf{i + 1}", "start": list(start), "uri": f"radio://{i // PER_DONGLE}/80/2M/E7E7E7E7{i + 1:02X}"}
            for i, start in enumerate(starts)
        ],
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
    """Connect twice, then rehearse one flight."""
    plan = flight_plan(count)
    before = most_memory()
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = folder
        tables = Path(folder) / "tables"
        tables.mkdir()
        cold, cached = _connection(plan, tables), _connection(plan, tables)
        rehearse(flight_plan(1), log_path=Path(folder) / "first.mcap")  # fills the flights' own cache
        start = time.process_time()
        outcome, _ = rehearse(plan, log_path=Path(folder) / "flight.mcap")
        cpu = time.process_time() - start
        memory = (most_memory() - before) / 1e6 / count
        alone = cflib_alone.cost(plan.mission, tables)
    ended = f"{outcome.phase.value} {outcome.reason}".strip()
    return Row(count, outcome.duration, cpu, alone, cold, cached, memory, ended)


def _connection(plan: FlightPlan, tables: Path) -> tuple[float, float]:
    """To connect everybody, with a folder of tables of contents that may be empty: CPU seconds, and flight seconds."""
    ends = []

    def connect(drone: Drone) -> None:
        drone.connect()
        ends.append(time.process_time())  # what follows is the world's time, in which the packets are on the air

    with Stage(plan.mission, air=AirModel.of(plan.mission)) as stage:
        clock = stage.clock
        fleet = Fleet([Drone(name, uri, clock, tables) for name, uri in stage.swarm.uris().items()], clock)
        start = time.process_time()
        fleet.each("connecting", connect, lambda: clock.sleep_until(clock.now() + 0.01))
        took = clock.now()
        for drone in fleet.values():
            drone.close(force=True)
    return max(ends) - start, took


def machine() -> tuple[float, float]:
    """How fast the machine is now: ns of a turn of an empty loop, and of adding two small arrays."""
    a, turns = np.ones((10, 3)), 200_000
    start = time.process_time()
    for _ in range(turns):
        pass
    middle = time.process_time()
    for _ in range(turns):
        np.add(a, a)
    scale = 1e9 / turns
    return (middle - start) * scale, (time.process_time() - middle) * scale


def run(counts: tuple[int, ...] = COUNTS) -> None:
    """Print the table."""
    print(HEADER)
    speeds = []
    for count in counts:
        command = [sys.executable, "-m", "tests.benchmarks.rehearsal", "--json", str(count)]
        speeds.append(machine())
        print(Row(**json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)), flush=True)
        speeds.append(machine())
    turn, addition = np.mean(speeds, axis=0)
    print(
        f"this machine, meanwhile: {turn:.0f} ns a turn of an empty loop, {addition:.0f} ns a sum of two small arrays"
    )


def _move(start: tuple[float, ...], altitude: float) -> PiecewisePolynomial:
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, 0] = SHIFT * _SMOOTH
    coefficients[0, 0, 0], coefficients[0, 1, 0], coefficients[0, 2, 0] = *start[:2], altitude
    return PiecewisePolynomial(np.array([DURATION]), coefficients)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.rehearsal", description=__doc__)
    parser.add_argument("counts", type=int, nargs="*", default=list(COUNTS), metavar="COUNT", help="drones")
    parser.add_argument("--json", action="store_true", help="measure in this process; print rows as JSON")
    arguments = parser.parse_args()
    if arguments.json:
        for count in arguments.counts:
            print(json.dumps(asdict(measure(count))))
    else:
        run(tuple(arguments.counts))


if __name__ == "__main__":
    main()
