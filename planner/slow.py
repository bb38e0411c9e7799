"""Where robots have to be slow for a moment: where one leg of a trajectory follows another."""

from __future__ import annotations

import numpy as np

from missions import fleet
from missions.arrays import Array
from missions.schema import Mission
from planner.certificate.switching import Switch, allowed_speed
from planner.margins import Margins, SlowPoint

AROUND = 0.6  # [s] before and after: the joints of the next fit are not exactly where those of this one were
SHARE = 0.8  # of the allowed speed that is planned
SLOWEST = 0.03  # [m/s] planned at a switch, however rough the radio


def slow_points(mission: Mission, switches: list[Switch]) -> tuple[SlowPoint, ...]:
    """How slow robots have to be at all their switches, if a jump is larger than the mission allows; else none.

    Also where they are slow enough already: the next plan is another one, and its legs want slow joints somewhere.
    """
    fast = {item.robot for item in switches if item.jump > mission.radio.switch_jump}
    return tuple(
        SlowPoint(item.robot, item.time, max(SLOWEST, SHARE * allowed_speed(mission, item)))
        for item in switches
        if item.robot in fast
    )


def speed_limits(mission: Mission, margins: Margins) -> Array:
    """Largest speeds to plan with [m/s]: (N,), or (T+1, N) if somebody has to be slow somewhere."""
    limits = fleet.speeds(mission) * (1.0 - margins.speed)
    if not margins.slow:
        return np.asarray(limits)
    t = np.arange(mission.steps + 1) * mission.horizon.dt
    by_step = np.tile(limits, (len(t), 1))
    for point in margins.slow:
        near = np.abs(t - point.time) <= max(AROUND, 0.75 * mission.horizon.dt)
        by_step[near, point.robot] = np.minimum(by_step[near, point.robot], point.speed)
    return by_step
