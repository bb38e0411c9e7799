"""Array aliases shared by every package."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def frozen(values: object) -> Array:
    """Return a read-only float64 copy of ``values``: what records hold."""
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array
