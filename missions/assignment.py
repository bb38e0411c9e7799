"""Who flies from which start, where the mission leaves that open: ``flight.assignment: cheapest``.

Decided when the mission is read, before anything is planned: starts and pads say all there is to know, so the search is
planned for the robots that will fly it, and whoever reads the same mission gets the same answer. The cost is the sum of
squared distances from pads to starts: then straight moves that share their progress do not collide in the plane if
starts and pads are √2 times the separation apart (Turpin, Michael, Kumar: CAPT, IJRR 2014); others are put in order by
the planner, and the certificate looks at all of them.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from missions.schema import Mission, Robot

_PREFERENCE = 1e-9  # [m²] for the robot that is listed with a start, where others would be as cheap


def assigned(mission: Mission) -> Mission:
    """The mission with its starts given to the robots that get there cheapest; itself if they are fixed.

    A start goes to a robot together with what belongs to it: where the search ends, and a velocity at its beginning.
    Robots exchange starts if they have the same limits, altitude and zones.
    """
    if mission.flight.assignment == "fixed":
        return mission
    from scipy.optimize import linear_sum_assignment  # slow to import

    robots = mission.robots
    pads = np.array([(robot.pad or robot.start)[:2] for robot in robots])
    starts = np.array([robot.start[:2] for robot in robots])
    cost = np.sum((pads[:, None] - starts) ** 2, axis=2) + _PREFERENCE * (1.0 - np.eye(len(robots)))
    alike = [[_may_do(mission, a) == _may_do(mission, b) for b in robots] for a in robots]
    cost[~np.array(alike)] = 4.0 * float(cost.max()) * len(robots) + 1.0  # dearer than any way all exchanges can cost
    _, given = linear_sum_assignment(cost)
    exchanged = tuple(_moved(robot, robots[k]) for robot, k in zip(robots, given, strict=True))
    return dataclasses.replace(mission, robots=exchanged)


def _may_do(mission: Mission, robot: Robot) -> tuple[object, ...]:
    """What has to be the same of robots that exchange their starts."""
    limits = mission.limits
    return (
        robot.limits.acceleration or limits.acceleration,
        robot.limits.speed or limits.speed,
        robot.altitude or mission.flight.altitude,
        tuple(k for k, zone in enumerate(mission.zones) if not zone.robots or robot.name in zone.robots),
    )


def _moved(robot: Robot, to: Robot) -> Robot:
    """A robot that takes off from its pad and flies another's search."""
    pad = robot.pad or robot.start[:2]
    return dataclasses.replace(robot, pad=pad, start=to.start, end=to.end, velocity=to.velocity)
