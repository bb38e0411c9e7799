"""The same mission on a fine time grid: what long steps leave to be smoothed.

Accelerations that are constant for long have corners that polynomials of few pieces cannot follow: a jump of j [m/s²]
between steps of dt [s] is j dt²/50 of position. The plan goes on with short steps, and with controls no faster than the
pieces in a drone's memory can be.
"""

from __future__ import annotations

import math
from dataclasses import replace

from missions.connectivity import SubPeriods
from missions.schema import Mission
from missions.topology import sub_period_times
from planner.indicators import ergodic_metric
from planner.plan import Plan
from planner.solver.modes import Weights

LONGEST = 0.25  # [s] of a step whose corners are nothing to polynomials
SMOOTH = 0.7  # fastest cosine mode of fine controls, in modes of the coarse ones
HALF_WAVES = 1.0  # [1/s] of the fastest mode where pieces are rounded, and none is shorter than 0.4 s
FEWEST = 10  # modes
SMOOTHER = 0.75  # modes that are left when what they give shakes too much, rounded


def finer(mission: Mission) -> Mission | None:
    """The mission with steps of at most :data:`LONGEST`, a whole number to each of its own; None if it has such steps.

    Sub-periods stay where they are.
    """
    dt, policy = mission.horizon.dt, mission.connectivity
    parts = math.ceil(dt / LONGEST - 1e-9)
    if parts <= 1:
        return None
    if isinstance(policy, SubPeriods):
        policy = replace(policy, boundaries=sub_period_times(mission)[1:-1])
    return replace(mission, horizon=replace(mission.horizon, dt=dt / parts), connectivity=policy)


def smooth_modes(mission: Mission) -> int:
    """Modes that controls on the finer grid are made of."""
    return max(1, round(SMOOTH * mission.steps))


def smoother(mission: Mission, modes: int | None) -> int | None:
    """Fewer modes than controls had, for steps that are short already; None if fewer would hardly move."""
    fewer = round(SMOOTHER * (min(Weights().modes, mission.steps) if modes is None else modes))
    return fewer if fewer >= FEWEST else None


def joint_modes(mission: Mission) -> int | None:
    """Modes of controls that are flown in rounded pieces from joint to joint; None if the mission has no joints."""
    if not mission.replanning.joints:
        return None
    return max(FEWEST, round(HALF_WAVES * mission.horizon.duration))


def at_steps(plan: Plan, mission: Mission) -> Plan:
    """A plan on the finer grid at the mission's own steps: positions and velocities then, mean controls."""
    parts = (len(plan.t) - 1) // mission.steps
    if parts == 1:
        return plan
    q = plan.q[::parts]
    return replace(
        plan,
        t=plan.t[::parts],
        q=q,
        v=plan.v[::parts],
        u=plan.u.reshape(mission.steps, parts, *plan.u.shape[1:]).mean(axis=1),
        ergodicity=ergodic_metric(mission).value(q[:-1]),
    )
