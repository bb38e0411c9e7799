"""``python -m tests.benchmarks [--seeds N]``: the tables of ``make bench``, in CPU seconds of one process."""

from __future__ import annotations

import argparse

from tests.benchmarks import (
    flightlog,
    footprint,
    library,
    long_log,
    pareto,
    planner,
    reference,
    rehearsal,
    surface,
    trajectories,
)


def main() -> None:
    """Run every benchmark."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("--seeds", type=int, default=1, help="seeds a problem (default 1)")
    planner.run(parser.parse_args().seeds)
    print()
    reference.run()
    print()
    trajectories.run()
    print()
    pareto.run()
    print()
    library.run()
    print()
    footprint.run()
    print()
    surface.run()
    print()
    rehearsal.run()
    print()
    flightlog.run()
    print()
    long_log.run()


if __name__ == "__main__":
    main()
