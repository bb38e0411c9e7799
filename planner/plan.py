"""The plan: what the solver returns and every later stage starts from."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from missions.arrays import Array


@dataclass(frozen=True)
class Plan:
    """Sampled trajectories of all robots, in the world frame.

    Attributes:
        t: (T+1,) [s], t[0] = 0, equal steps dt; the search's statistics use the first T samples, the last one is
            the state at the end of the horizon.
        q: (T+1, N, ν) positions [m].
        v: (T+1, N, ν) velocities [m/s]; v[0] = v[-1] = 0.
        u: (T, N, ν) controls, constant over a step: accelerations [m/s²] for the double integrator.
        ergodicity: E of q[:T].
        violation: worst constraint violation of the planner's (tightened) problem [m equivalent].
        seed: seed used.
        evaluations: objective evaluations spent.
        seconds: CPU seconds spent.
    """

    t: Array
    q: Array
    v: Array
    u: Array
    ergodicity: float
    violation: float
    seed: int = 0
    evaluations: int = 0
    seconds: float = 0.0

    def __post_init__(self) -> None:
        for item in dataclasses.fields(self):
            value = getattr(self, item.name)
            if hasattr(value, "setflags"):
                value.setflags(write=False)

    @property
    def dt(self) -> float:
        """Time step [s]."""
        return float(self.t[1] - self.t[0])
