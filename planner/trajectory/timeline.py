"""Where a trajectory in legs really is: a leg runs from its own start and holds its end until the next one begins."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence

import numpy as np

from missions.arrays import Array
from planner.trajectory.encode import decode_leg
from planner.trajectory.encoded import EncodedTrajectory
from planner.trajectory.legs import switch_times


class Timeline:
    """From clock time to time in the certified trajectory, for one robot.

    Before the first leg has begun the trajectory is at its start.

    Args:
        times: when legs should begin, and when the last one ends [s since the start]: (legs + 1,).
        starts: when they began, by some clock [s]; may grow by :meth:`begin`.
    """

    def __init__(self, times: Sequence[float], starts: Sequence[float] = ()) -> None:
        self.times, self._starts = tuple(times), list(starts)

    @classmethod
    def of(cls, encoded: EncodedTrajectory, starts: Sequence[float] = ()) -> Timeline:
        """The timeline of a trajectory's legs. Raises TrajectoryError for bytes that are none."""
        return cls(switch_times([decode_leg(leg).duration for leg in encoded.legs]), starts)

    @property
    def legs(self) -> int:
        """Number of legs."""
        return len(self.times) - 1

    @property
    def begun(self) -> int:
        """Number of legs that have begun."""
        return len(self._starts)

    @property
    def latest(self) -> float:
        """When the leg that flies began [s]; NaN while none has."""
        return self._starts[-1] if self._starts else math.nan

    def begin(self, t: float) -> None:
        """The next leg began at t [s]."""
        self._starts.append(t)

    def restart(self, t: float) -> None:
        """The first leg began at t [s], whatever was thought before."""
        self._starts = [t]

    def at(self, t: float) -> float:
        """Time in the trajectory [s] at clock time t [s]; NaN while none has begun."""
        if not self._starts:
            return math.nan
        leg = max(0, bisect_right(self._starts, t) - 1)
        return min(self.times[leg] + max(t - self._starts[leg], 0.0), self.times[leg + 1])

    def at_each(self, t: Array) -> Array:
        """The same for many clock times [s]."""
        if not self._starts:
            return np.full(len(t), math.nan)
        times, starts = np.array(self.times), np.array(self._starts)
        leg = np.maximum(np.searchsorted(starts, t, side="right") - 1, 0)
        within: Array = np.minimum(times[leg] + np.maximum(t - starts[leg], 0.0), times[leg + 1])
        return within

    def holds(self, t: float) -> bool:
        """Whether the robot stands still at clock time t [s]: not yet begun, or its leg has ended."""
        if not self._starts or t < self._starts[0]:
            return True
        leg = bisect_right(self._starts, t) - 1
        return t - self._starts[leg] > self.times[leg + 1] - self.times[leg]
