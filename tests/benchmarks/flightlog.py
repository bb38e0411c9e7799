"""``python -m tests.benchmarks.flightlog``: records a second that one core writes and reads, disk and all."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from deploy.flightlog.reader import read_log
from deploy.flightlog.writer import FlightLog

ASKED = 20_000  # records a second, issue 7
RECORDS = 100_000
RATE = 1000.0  # records per second of flight: ten drones
_ROBOTS = tuple(f"cf{i}" for i in range(10))


def _pose(log: FlightLog, robot: str, t: float) -> None:
    log.pose(robot, t, (1.2345678 + t, 2.3456789 - t, 0.6123456), (0.01, 0.02, 0.03, 0.9993497))


def _estimate(log: FlightLog, robot: str, t: float) -> None:
    place = (1.2345678 + t, 2.3456789 - t, 0.6123456)
    log.estimate(robot, t, place, (0.1234567, -0.2345678, 0.0123456), (0.0123, -0.0234, 1.5678), tick=int(1000 * t))


def _battery(log: FlightLog, robot: str, t: float) -> None:
    log.battery(robot, t, 4.1 - 0.001 * t, level=80.0, state=0)


def _event(log: FlightLog, robot: str, t: float) -> None:
    # No drone says anything a hundred times a second; each of them waits for the disk.
    log.event(t, "note", "something happened", phase="on_mission", robot=robot)


KINDS: dict[str, tuple[Callable[[FlightLog, str, float], None], int]] = {
    "poses": (_pose, RECORDS),
    "estimates": (_estimate, RECORDS),
    "batteries": (_battery, RECORDS),
    "events": (_event, RECORDS // 100),
}


def measure(write: Callable[[FlightLog, str, float], None], count: int) -> tuple[float, float, float]:
    """Records per CPU second written and read, and bytes a record takes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.mcap"
        start = time.process_time()
        with FlightLog(path, 1.0e9, {}, {}, when_full="wait") as log:
            for i in range(count):
                write(log, _ROBOTS[i % len(_ROBOTS)], i / RATE)
        wrote = time.process_time()
        read_log(path)
        read = time.process_time()
        return count / (wrote - start), count / (read - wrote), path.stat().st_size / count


def run() -> None:
    """Print the table."""
    print(f"{'flight log':12s} {'written/CPU s':>14s} {'asked':>8s} {'read/CPU s':>12s} {'bytes each':>11s}")
    for name, (write, count) in KINDS.items():
        written, read, size = measure(write, count)
        asked = f"{ASKED:8,d}" if name != "events" else f"{'–':>8s}"
        print(f"{name:12s} {written:14,.0f} {asked} {read:12,.0f} {size:11.0f}", flush=True)


if __name__ == "__main__":
    run()
