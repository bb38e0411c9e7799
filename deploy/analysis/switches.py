"""Where one leg of a trajectory followed another: how late it began, and how far the setpoint jumped for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from deploy.analysis.align import MissionWindow
from deploy.flightlog.reader import FlightRecord
from planner.certificate.switching import switches
from planner.flightplan import FlightPlan
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.trajectory.timeline import Timeline


@dataclass(frozen=True)
class FlownSwitch:
    """One switch of one robot, as it was flown.

    Attributes:
        robot: name. leg: number of the leg that began, from 1. time: mission time of the switch [s].
        late: how late its start was, by the flight's schedule [s]; negative: early.
        jump: how far apart the setpoints were that the two starts made of one [m]. bound: what was certified [m].
    """

    robot: str
    leg: int
    time: float
    late: float
    jump: float
    bound: float


def timelines(record: FlightRecord, plan: FlightPlan, window: MissionWindow) -> dict[str, Timeline]:
    """Where in its trajectory each robot was, by flight clock: from when its legs really began."""
    found = {}
    for robot in plan.mission.robots:
        starts = [event.t for event in record.events if event.name == "leg_start" and event.robot == robot.name]
        found[robot.name] = Timeline.of(plan.trajectories[robot.name], starts or [window.start])
    return found


def flown_switches(
    record: FlightRecord, plan: FlightPlan, references: Mapping[str, PiecewisePolynomial]
) -> tuple[FlownSwitch, ...]:
    """Every switch that was flown, robots in the mission's order; nothing if everybody had one leg.

    A leg that begins later than the one before has ended makes the setpoint wait, one that begins earlier makes it
    jump ahead; either way it is the path flown in that time, and its chord what is given here.
    """
    certified = {(item.robot, item.leg): item for item in switches(plan.mission, plan.trajectories)}
    found = []
    for number, robot in enumerate(plan.mission.robots):
        starts = [event for event in record.events if event.name == "leg_start" and event.robot == robot.name]
        lates = [event.value or 0.0 for event in starts]
        for leg in range(1, len(lates)):
            switch, gap = certified[number, leg], lates[leg] - lates[leg - 1]
            times = switch.time + np.array([0.0, gap, -gap])
            points = references[robot.name].evaluate(times)[:, :3]
            jump = float(np.linalg.norm(points[1:] - points[0], axis=1).max())
            found.append(FlownSwitch(robot.name, leg + 1, switch.time, lates[leg], jump, switch.jump))
    return tuple(found)
