"""A flight in three legs: two drones on circles, side by side."""

import dataclasses

import numpy as np

from missions.schema import Horizon, TrajectorySettings
from planner.trajectory.encode import encode
from planner.trajectory.piecewise import PiecewisePolynomial
from tests.deploy.flight_bench import certified, small_mission
from tests.planner.long_curves import through

RADIUS, RATE = 0.35, 0.8  # [m], [rad/s]
PIECE, RAMP = 0.45, 1.5  # [s]
POLY4D = TrajectorySettings(encoding="poly4d")


def long_mission(pieces=34, **changes):
    mission = small_mission()
    horizon = Horizon(round(2 * RAMP + (pieces - 2) * PIECE, 3), 0.1)
    return dataclasses.replace(mission, horizon=horizon, trajectory=POLY4D, **changes)


def long_plan(pieces=34, **changes):
    mission = long_mission(pieces, **changes)
    z = mission.flight.altitude
    return certified(mission, {r.name: encode(circles((*r.start, z), pieces), POLY4D) for r in mission.robots})


def circles(start, pieces):
    """Round and round with a start and an end at rest; 15 pieces fit one half of the memory."""
    durations = np.full(pieces, PIECE)
    durations[[0, -1]] = RAMP
    joints = np.concatenate([[0.0], np.cumsum(durations)])
    angle = RATE * (joints - RAMP / 2)
    angle[[0, -1]] = 0.0, RATE * (joints[-1] - RAMP)
    states = np.zeros((pieces + 1, 4, 3))
    for order in range(4):
        turned = np.pi + angle + order * np.pi / 2
        states[:, order, :2] = RADIUS * RATE**order * np.stack([np.cos(turned), np.sin(turned)], axis=1)
    states[[0, -1], 1:] = 0.0
    states[:, 0] += np.add(start, (RADIUS, 0.0, 0.0))
    return PiecewisePolynomial(durations, through(durations, states).coefficients)
