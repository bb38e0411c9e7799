"""The flight that everything happens to: four drones, every phase, over in a few seconds.

Three search side by side, one above them; starts are beside the pads, so that everybody transfers and returns.
"""

import functools

import numpy as np

from missions.loader import parse_mission
from planner.trajectory.encode import encode
from planner.trajectory.piecewise import PiecewisePolynomial
from tests.deploy.flight_bench import SMOOTH, certified

TEXT = """
schema_version: 1
name: arena
workspace: {{lower: [0.0, 0.0], upper: [3.2, 2.0]}}
horizon: {{duration: 2.5, dt: 0.1}}
information: {{type: gaussians, components: [{{mean: [1.5, 1.0], covariance: 0.1}}]}}
robots:
  - {{name: cf1, pad: [0.7, 0.5], start: [0.7, 0.8]}}
  - {{name: cf2, pad: [1.3, 0.5], start: [1.3, 0.8]}}
  - {{name: cf3, pad: [1.9, 0.5], start: [1.9, 0.8]}}
  - {{name: cf4, pad: [2.5, 0.5], start: [2.2, 0.8], altitude: 1.1}}
limits: {{acceleration: 1.0, speed: 1.0, separation: 0.3}}
flight: {{altitude: 0.5, takeoff_duration: 1.6, landing_duration: 1.6, settle_time: 0.5, transfer_speed: 0.45}}
radio: {{drones_per_dongle: 2}}
safety: {{on_host_loss: {on_host_loss}, hold_time: 2.0, {policies}}}
"""
KINDS = ("link", "supervisor", "pose", "identity", "tracking", "separation", "geofence", "battery", "tilt")
NAMES = ("cf1", "cf2", "cf3", "cf4")
WAYS = {"cf1": (0.1, 0.6), "cf2": (0.0, -0.5), "cf3": (-0.1, 0.6), "cf4": (-0.7, 0.2)}  # [m] how far the search leads


@functools.cache
def arena(on_host_loss="continue", policy="land_all"):
    """The mission."""
    policies = ", ".join(f"{kind}: {policy}" for kind in KINDS)
    text = TEXT.format(on_host_loss=on_host_loss, policies=policies)
    return parse_mission(text, path="arena.yaml", read_file={}.__getitem__)


@functools.cache
def arena_plan(on_host_loss="continue", policy="land_all"):
    """The certified plan."""
    mission = arena(on_host_loss, policy)
    moves = {robot.name: encode(_move(robot, mission)) for robot in mission.robots}
    return certified(mission, moves)


def _move(robot, mission):
    duration = mission.horizon.duration
    coefficients = np.zeros((1, 4, 8))
    for axis, (begin, shift) in enumerate(zip(robot.start, WAYS[robot.name], strict=True)):
        coefficients[0, axis] = shift * SMOOTH * duration ** -np.arange(8.0)
        coefficients[0, axis, 0] += begin
    coefficients[0, 2, 0] = robot.altitude or mission.flight.altitude
    return PiecewisePolynomial(np.array([duration]), coefficients)
