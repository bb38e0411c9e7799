"""``make chaos``: every fault in every phase, random sequences of faults, kills of the real process, larger swarms.

The rules that every flight is judged by are in ``tests/chaos/judge.py``; ``pytest -m chaos`` runs the same as tests.
``python -m tests.benchmarks.chaos --only 'swap / |seed 17$'`` flies some. A flight that breaks a rule is printed with
the scenario file that repeats it, to the last digit.
"""

from __future__ import annotations

import argparse
import logging
import multiprocessing
import os
import re
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from tests.chaos.faults import FAULTS, PHASES, Case, matrix, sequence
from tests.chaos.flown import fly
from tests.chaos.host import kill
from tests.chaos.judge import HARD, Judged, judge
from tests.chaos.test_sigkill import random_kills
from tests.chaos.test_swarms import BAD_DAY, dry_run

SEEDS = 200
_MARK = (" ", "!")  # of a cell whose flight broke a rule
HEADER = f"{'fault / phase':38s} {'outcome':10s} {'apart':>6s} {'struck':>6s} {'beyond':>6s} {'down':>5s}   said"


class Flight(NamedTuple):
    """One flight: what went wrong in it, what came of it, what was said, CPU seconds."""

    case: Case
    judged: Judged
    said: str
    cpu: float

    def __str__(self) -> str:
        j = self.judged
        line = (
            f"{self.case.name:38s} {j.outcome:10s} {j.separation:6.2f} {j.struck:6.2f} {j.excursion:6.2f} {j.down:5.1f}"
        )
        return "\n".join([f"{line}   {self.said[:60]}", *(f"    BROKEN: {problem}" for problem in j.problems)])


def flown(case: Case) -> Flight:
    """Fly and judge one case."""
    start = time.process_time()
    flight = fly(case)
    judged = judge(flight)
    said = getattr(flight.ended, "reason", None)
    return Flight(case, judged, str(flight.ended) if said is None else said, time.process_time() - start)


def run(cases: Iterable[Case], jobs: int) -> list[Flight]:
    """Fly cases in so many processes, and print a line for each."""
    flights = []
    print(HEADER)
    with multiprocessing.get_context("spawn").Pool(jobs, _quiet) as pool:
        for flight in pool.imap(flown, cases):
            print(flight, flush=True)
            flights.append(flight)
    return flights


def summary(flights: list[Flight]) -> None:
    """Outcomes by fault and phase, and the worst figures."""
    cells = {flight.case.name: flight.judged for flight in flights}
    if all(f"{fault} / {phase}" in cells for fault in FAULTS for phase in PHASES):
        print(f"\n{'':22s} {' '.join(f'{phase[:10]:10s}' for phase in PHASES)}")
        for fault in FAULTS:
            row = [cells[f"{fault} / {phase}"] for phase in PHASES]
            print(f"{fault:22s} {' '.join(f'{j.outcome:9s}{_MARK[bool(j.problems)]}' for j in row)}")
    outcomes = ", ".join(f"{count} {name}" for name, count in Counter(f.judged.outcome for f in flights).most_common())
    print(
        f"\n{len(flights)} flights: {outcomes}; smallest separation {min(f.judged.separation for f in flights):.2f} m "
        f"(asked: {HARD} m), the struck included {min(f.judged.struck for f in flights):.2f} m; slowest to the ground "
        f"{max((f.judged.down for f in flights if f.judged.outcome == 'aborted'), default=0.0):.1f} s; "
        f"{sum(bool(f.judged.problems) for f in flights)} broke a rule; {sum(f.cpu for f in flights):.0f} CPU s"
    )
    for flight in flights:
        if flight.judged.problems:
            name, text, _, on_host_loss, policy = flight.case
            print(f"\n# {name}, on_host_loss: {on_host_loss}, policies: {policy}\n{text}", end="")


def kills(jobs: int) -> int:
    """Kill the real process at random times; how many ended otherwise than the README says."""
    broken = 0
    with multiprocessing.get_context("spawn").Pool(max(1, jobs // 2)) as pool:  # two busy processes each
        for (kind, seconds), fate in zip(random_kills(), pool.imap(_killed, random_kills()), strict=True):
            print(f"{kind:10s} killed after {seconds:5.2f} s, {fate.phase:12s}: {fate.after}", flush=True)
            broken += bool(fate.problems)
            for problem in fate.problems:
                print(f"    BROKEN: {problem}")
    print(f"{len(random_kills())} kills, {broken} unlike the README")
    return broken


def swarms() -> int:
    """Ten drones with losses and dropouts, thirty without; how many did not complete their mission."""
    broken = 0
    for count, text in ((10, BAD_DAY), (30, None)):
        start = time.process_time()
        with tempfile.TemporaryDirectory() as folder:
            outcome, _ = dry_run(count, Path(folder), text)
        broken += not outcome.completed
        print(
            f"{count} drones{', 5 % loss and 2 dropouts' if text else ''}: {outcome.phase.value} {outcome.reason}; "
            f"largest error {max(outcome.largest_error.values()) * 100:.1f} cm, {time.process_time() - start:.0f} CPU s"
        )
    return broken


def _killed(order: tuple[str, float]) -> object:
    with tempfile.TemporaryDirectory() as folder:
        return kill(*order, Path(folder))


def _quiet() -> None:
    """What cflib has to say of lost links is no news here."""
    logging.disable(logging.CRITICAL)


@contextmanager
def _cache() -> Iterator[None]:
    """Tables of contents of the simulated drones, fetched once."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = folder
        yield


def main() -> int:
    """Command line; 1 if a rule was broken."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.chaos", description=__doc__)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes [default: one a core]")
    parser.add_argument("--only", metavar="REGEX", help="only the flights with such a name")
    arguments = parser.parse_args()
    with _cache():
        cases = [*matrix(), *(sequence(seed) for seed in range(SEEDS))]
        if arguments.only:
            cases = [case for case in cases if re.search(arguments.only, case.name)]
        flights = run(cases, arguments.jobs)
        broken = sum(bool(flight.judged.problems) for flight in flights)
        summary(flights)
        if not arguments.only:
            print()
            broken += kills(arguments.jobs) + swarms()
    return int(broken > 0)


if __name__ == "__main__":
    sys.exit(main())
