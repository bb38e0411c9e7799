"""What drones do after this computer died, at random times of a flight: ``python -m tests.benchmarks.host_loss``."""

import random
import re
import sys
import tempfile
from collections import Counter
from pathlib import Path

from tests.deploy.test_execute_host_loss import killed

TIMES = 20
LONGEST = 14.0  # s of flight clock; such a flight takes about so long


def fate(line):
    """One drone's end in two words."""
    found = re.search(r"on the ground ([\d.]+) s later", line)
    if found is None:
        return line.rpartition(", ")[2]
    return f"down within {max(1, -(-float(found[1]) // 1)):.0f} s"


def main():
    """Kill as many flights as there are random times, with either setting; print what became of the drones."""
    chance = random.Random(int(sys.argv[1]) if len(sys.argv) > 1 else 0)
    times = sorted(round(chance.uniform(0.2, LONGEST), 2) for _ in range(TIMES))
    with tempfile.TemporaryDirectory() as folder:
        for kind in ("continue", "motor_stop"):
            fates = Counter()
            for at in times:
                death = killed(Path(folder), kind, at)
                lines = getattr(death, "after", ("flight was over",))
                fates.update(fate(line) for line in lines)
                print(f"{kind:10}  killed at {at:5.2f} s: {'; '.join(lines)}", flush=True)
            print(f"{kind:10}  {dict(fates)}", flush=True)


if __name__ == "__main__":
    main()
