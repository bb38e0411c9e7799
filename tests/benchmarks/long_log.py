"""``python -m tests.benchmarks.long_log [--minutes M] [--drones N] [-o FILE]``: what a long flight's report costs.

Writes the log of a flight that could have been, at the rates of a real one, and reports it in a process of its own:
CPU seconds and most memory, against what is asked (ten minutes of ten drones: 20 s, 1 GB).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from deploy.flight.picture import Picture
from deploy.flight.poses import Located
from deploy.flightlog.writer import FlightLog
from deploy.planfile import plan_bytes
from missions.arrays import Array
from missions.loader import parse_mission
from missions.schema import Mission
from mocap.source import Pose
from planner.certificate.certify import certify
from planner.flightplan import FlightPlan
from planner.indicators import indicators
from planner.plan import Plan
from planner.trajectory.encode import decode, encode
from planner.trajectory.piecewise import PiecewisePolynomial
from tests.benchmarks.memory import most_memory

ASKED_CPU, ASKED_MEMORY = 20.0, 1.0  # s, GB: issue 7, for ten minutes of ten drones
CELL = 1.2  # m, side of the square each drone moves in
LEG = 20.0  # s between two rests
EPOCH = 1_767_225_600.0
BEGIN, TAIL = 5.0, 5.0  # s before and after the search
POSE_RATE, SLOWER = 50, 5  # Hz, and every which step telemetry comes
LAG, NOISE = 0.07, 0.002  # s, m


def mission(drones: int, duration: float) -> Mission:
    """Drones side by side, each in a cell of its own."""
    text = {
        "schema_version": 1,
        "name": "long_flight",
        "workspace": {"lower": [0.0, 0.0], "upper": [CELL * drones, CELL]},
        "horizon": {"duration": duration, "dt": 0.5},
        "information": {
            "type": "gaussians",
            "components": [{"mean": [0.5 * CELL * drones, 0.5 * CELL], "covariance": 0.5}],
        },
        "connectivity": {"policy": "probabilistic", "range": CELL, "sub_periods": 3, "threshold": 0.01},
        "limits": {"acceleration": 1.0, "separation": 0.2},
        "robots": [{"name": f"cf{i + 1}", "start": [(i + 0.5) * CELL, 0.5 * CELL]} for i in range(drones)],
    }
    return parse_mission(json.dumps(text), path="long_flight.yaml", read_file={}.__getitem__)


def flight_plan(drones: int, duration: float) -> FlightPlan:
    """Everybody from rest to rest within his cell, a leg every 20 s."""
    asked, rng = mission(drones, duration), np.random.default_rng(1)
    pieces = round(duration / LEG)
    T = duration / pieces
    quintic = np.array([0, 0, 0, 10 / T**3, -15 / T**4, 6 / T**5, 0, 0])
    trajectories = {}
    for robot in asked.robots:
        goals = np.array(robot.start) + rng.uniform(-0.45, 0.45, (pieces + 1, 2)) * CELL
        goals[0] = robot.start
        c = np.zeros((pieces, 4, 8))
        c[:, :2] = quintic * np.diff(goals, axis=0)[:, :, None]
        c[:, :2, 0], c[:, 2, 0] = goals[:-1], 0.6
        trajectories[robot.name] = encode(PiecewisePolynomial(np.full(pieces, T), c), asked.trajectory)
    t = np.arange(asked.steps + 1) * asked.horizon.dt
    q = np.stack([decode(item).evaluate(t)[:, :2] for item in trajectories.values()], axis=1)
    v = np.gradient(q, asked.horizon.dt, axis=0)
    found = indicators(asked, t, q)
    plan = Plan(t, q, v, np.diff(v, axis=0) / asked.horizon.dt, found.ergodicity, 0.0)
    return FlightPlan(asked, plan, trajectories, certify(asked, trajectories), {"ergoflie": "benchmark"})


def write_log(path: Path, drones: int, minutes: float) -> int:
    """Write the log of such a flight; returns its number of records."""
    duration = 60.0 * minutes
    flown = flight_plan(drones, duration)
    end, rng, records = BEGIN + duration, np.random.default_rng(2), 0
    names = list(flown.trajectories)
    t = np.arange(round((end + TAIL) * POSE_RATE)) / POSE_RATE
    asked_for = _tracks(flown, t)
    truth = _tracks(flown, t - LAG) + NOISE * rng.standard_normal(asked_for.shape)
    velocity = np.gradient(asked_for, 1.0 / POSE_RATE, axis=0)
    events = {0.0: ("phase", "airborne"), BEGIN: ("mission_start", "on_mission"), end: ("mission_end", "landing")}
    rehearsed = {"backend": "simulated", "seed": "0"}
    with FlightLog(path, EPOCH, {"plan.mcap": plan_bytes(flown)}, rehearsed, when_full="wait") as log:
        picture = Picture(log, flown, {name: decode(item) for name, item in flown.trajectories.items()}, 0.0)
        for step, now in enumerate(t.tolist()):
            if now in events:
                log.event(now, events[now][0], "now", phase=events[now][1])
            for i, name in enumerate(names):
                position = truth[step, i].tolist()
                log.pose(name, now, position, (0.0, 0.0, 0.0, 1.0))
                records += 1
                if step % SLOWER:
                    continue
                target, speed = asked_for[step, i].tolist(), velocity[step, i].tolist()
                log.estimate(name, now, position, speed, (0.01, -0.02, 0.0), tick=step * 20)
                log.setpoint(name, now, target, speed, 0.0, tick=step * 20)
                log.battery(name, now, 4.1 - 0.8 * now / end, 80.0, 0)
                log.motors(name, now, (36_000 + 3 * step % 500, 36_100, 35_900, 36_050))
                log.supervisor(name, now, 0x1E, ["can_fly", "flying"])
                if BEGIN <= now <= end:
                    log.reference(name, now, target, speed)
                records += 6
            if step % SLOWER == 0:
                seen = {name: Located(now, Pose(tuple(truth[step, i].tolist()))) for i, name in enumerate(names)}
                picture.show(now, seen)
                if step % (2 * SLOWER) == 0 and BEGIN <= now <= end:
                    picture.cover(now, seen)
            if step % POSE_RATE == 0:
                counts = {"sent": step * 3, "received": step * 3, "lost": 0}
                for name in names:
                    log.link(name, now, latency_ms=5.0, quality=99.0, rssi=-50.0, **counts)
    return records


def _tracks(flown: FlightPlan, t: Array) -> Array:
    """(S, N, 3) where everybody is asked to be."""
    paths = [decode(item) for item in flown.trajectories.values()]
    return np.stack([path.evaluate(np.clip(t - BEGIN, 0.0, path.duration))[:, :3] for path in paths], axis=1)


def report(path: Path) -> dict[str, float]:
    """Report in this process: CPU seconds to read, analyse, build the page; most memory [GB]; size of the page [MB]."""
    from deploy.analysis import analyse
    from deploy.flightlog.reader import read_log
    from deploy.report import build_report

    marks = [time.process_time()]
    record = read_log(path)
    marks.append(time.process_time())
    analysis = analyse(record)
    marks.append(time.process_time())
    page = build_report(analysis)
    marks.append(time.process_time())
    read, judged, built = np.diff(marks).tolist()
    return {
        "read": read,
        "analyse": judged,
        "page": built,
        "memory": most_memory() / 1e9,
        "size": len(page.encode()) / 1e6,
    }


def run(drones: int = 10, minutes: float = 10.0, path: Path | None = None) -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        target = path or Path(folder) / "long.mcap"
        start = time.process_time()
        records = write_log(target, drones, minutes)
        wrote = time.process_time() - start
        command = [sys.executable, "-m", "tests.benchmarks.long_log", "--report", str(target)]
        found = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        print(f"report of {minutes:g} min of {drones} drones: {records} records, {target.stat().st_size / 1e6:.1f} MB,")
        print(f"written with the plan in {wrote:.1f} CPU s")
    parts = (found["read"], found["analyse"], found["page"])
    headings = ("read", "analyse", "page", "all CPU s", "asked", "GB", "asked", "page MB")
    print(" ".join(f"{heading:>9s}" for heading in headings))
    figures = (*parts, sum(parts), ASKED_CPU, found["memory"], ASKED_MEMORY, found["size"])
    print(" ".join(f"{figure:9.2f}" for figure in figures))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.long_log", description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--drones", type=int, default=10)
    parser.add_argument("-o", "--output", type=Path, help="keep the log here")
    parser.add_argument("--report", type=Path, metavar="LOG", help="report this log in this process; print JSON")
    arguments = parser.parse_args()
    if arguments.report:
        print(json.dumps(report(arguments.report)))
    else:
        run(arguments.drones, arguments.minutes, arguments.output)


if __name__ == "__main__":
    main()
