"""Most memory that this process ever had.

Linux hands the largest ``ru_maxrss`` of a process down to the programs it starts, so behind a large parent that says
nothing of a child; the high-water mark of the child's own address space does.
"""

from __future__ import annotations

import re
import resource
import sys
from pathlib import Path

_STATUS = Path("/proc/self/status")


def most_memory() -> float:
    """In bytes."""
    if _STATUS.exists() and (found := re.search(r"VmHWM:\s*(\d+) kB", _STATUS.read_text())):
        return 1024.0 * int(found[1])
    unit = 1 if sys.platform == "darwin" else 1024
    return float(unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
