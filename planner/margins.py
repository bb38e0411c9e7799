"""How much tighter than the mission the planner plans."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SlowPoint:
    """A robot by index, a time [s], and how fast it may be around then [m/s]."""

    robot: int
    time: float
    speed: float


@dataclass(frozen=True)
class Margins:
    """How much tighter than the mission the planner plans.

    Attributes:
        separation: added to the distance between robots [m]; two robots deviate, hence about twice the others.
        obstacle: added to obstacles' radii [m]. workspace: taken off every side [m].
        acceleration: share taken off the acceleration limit. speed: share taken off the speed limit.
        probability: share added to the connection probability's threshold.
        range: taken off the communication range where robots have to meet [m].
        contact: added to the time robots have to stay in contact [s].
        slow: where robots are slow because one leg of their trajectory follows another.
    """

    separation: float = 0.004
    obstacle: float = 0.0025
    workspace: float = 0.002
    acceleration: float = 0.035
    speed: float = 0.015
    probability: float = 0.005
    range: float = 0.003
    contact: float = 0.05
    slow: tuple[SlowPoint, ...] = ()
