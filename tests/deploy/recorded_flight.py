"""Recorded flights of real firmware, and a stand-in firmware that asks a simulated world for the same flight."""

import json
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deploy.radio.simulated.interface import Orders, PoseMeasurement, Setpoint, SetpointMode
from deploy.radio.simulated.physics.algebra import GRAVITY
from deploy.radio.simulated.physics.world import TICK, World
from missions.airframes import airframe
from missions.arrays import Array
from planner.trajectory.piecewise import PiecewisePolynomial

GOLDEN = Path(__file__).parent.parent / "golden"
_ACTS_AFTER = 0.005  # [s] a packet acts 1 to 10 ms after it was passed to the firmware
_REST_TO_REST = (0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0)


@dataclass
class RecordedFlight:
    """A recording: ``knots`` (start time, polynomial) in the order flown, trajectory times, and the true path."""

    record: dict
    knots: list[tuple[float, PiecewisePolynomial]]
    start: float
    duration: float
    end: float

    @property
    def truth(self) -> tuple[Array, Array]:
        rows = np.array(self.record["truth"])
        return rows[:, 0] / 1e3, rows[:, 1:4]

    def goal(self, t: Array, derivative: int = 0) -> Array:
        """x, y, z, yaw (len(t), 4) of the setpoint at firmware times t; zeros before the take-off."""
        out = np.zeros((len(t), 4))
        for begin, polynomial in self.knots:
            later = t >= begin
            out[later] = polynomial.evaluate(t[later] - begin, derivative)
        return out


def load(name: str) -> RecordedFlight:
    record = json.loads((GOLDEN / f"flight_{name}.json").read_text())
    here = np.array([record["start"]["x"], record["start"]["y"], 0.0, record["start"]["yaw"]])
    knots, start, duration, end = [], 0.0, 0.0, 0.0
    for command in record["commands"]:
        begin, payload = command["t_ms"] / 1e3 + _ACTS_AFTER, bytes.fromhex(command["hex"])
        if command["command"] == "start_trajectory":
            polynomial = _trajectory(record["trajectory"], here)
            start, duration = begin - _ACTS_AFTER, polynomial.duration
            here = polynomial.evaluate(np.array([polynomial.duration]))[0]
        else:
            if command["command"] == "go_to":
                *goal, seconds = struct.unpack("<5f", payload[4:24])
                there = np.array(goal)
            else:
                height, seconds = struct.unpack("<f", payload[2:6])[0], struct.unpack("<f", payload[-4:])[0]
                there = np.array([here[0], here[1], height, here[3]])
            polynomial = _move(here, there, seconds)
            here, end = there, begin + seconds
        knots.append((begin, polynomial))
    return RecordedFlight(record, knots, start, duration, end)


def _move(a: Array, b: Array, seconds: float) -> PiecewisePolynomial:
    shape = np.array(_REST_TO_REST) / seconds ** np.arange(8)
    coefficients = np.outer(b - a, shape)
    coefficients[:, 0] += a
    return PiecewisePolynomial(np.array([seconds]), coefficients[None])


def _trajectory(trajectory: dict, here: Array) -> PiecewisePolynomial:
    scale = trajectory["timescale"]
    durations = scale * np.array([piece["duration"] for piece in trajectory["pieces"]])
    coefficients = np.array([[piece[axis] for axis in ("x", "y", "z", "yaw")] for piece in trajectory["pieces"]])
    coefficients = coefficients / scale ** np.arange(8)
    if trajectory["relative_position"]:
        coefficients[:, :3, 0] += here[:3] - coefficients[0, :3, 0]
    return PiecewisePolynomial(durations, coefficients)


class Replayer:
    """A firmware that follows the recording's setpoints with an exact pose at every tick, as the recorder had."""

    def __init__(self, flight: RecordedFlight, world: World, lead: float = 1.0) -> None:
        self.world = world
        self.begin = round(flight.knots[0][0] - lead, 2)
        times = self.begin + TICK * np.arange(int((flight.end - self.begin + 2.0) / TICK))
        goals = np.stack([flight.goal(times, k) for k in range(4)], axis=1)
        controller, start = flight.record["stabilizer_controller"], flight.record["start"]
        pose = ((start["x"], start["y"], 0.0), float(start["yaw"]))
        flying = (times >= flight.knots[0][0]) & (times <= flight.end)
        self.times = times
        self._setpoints = [_full(*goal) if on else Setpoint() for goal, on in zip(goals, flying, strict=True)]
        self._orders = {"motors_allowed": True, "controller": controller, "initial_pose": pose}

    def glance(self, t):
        return None

    def tick(self, t, telemetry):
        ticks = round(t / TICK)
        seen = PoseMeasurement(tuple(self.world.positions[0]), tuple(self.world.quaternions[0]))
        return Orders(
            setpoint=self._setpoints[min(ticks, len(self._setpoints) - 1)],
            measurements=(seen,),
            reset_estimator=ticks == 1,
            **self._orders,
        )


def _full(position: Array, velocity: Array, acceleration: Array, jerk: Array) -> Setpoint:
    """A FULL setpoint with the body rates that differential flatness gives (Mellinger and Kumar 2011, eq. 7)."""
    force = acceleration[:3] + np.array([0.0, 0.0, GRAVITY])
    z = force / np.linalg.norm(force)
    y = np.cross(z, [np.cos(position[3]), np.sin(position[3]), 0.0])
    y /= np.linalg.norm(y)
    h = (jerk[:3] - z * (z @ jerk[:3])) / np.linalg.norm(force)
    omega = (-float(h @ y), float(h @ np.cross(y, z)), float(velocity[3] * z[2]))
    vectors = [tuple(v[:3].tolist()) for v in (position, velocity, acceleration, jerk)]
    return Setpoint(SetpointMode.FULL, *vectors, yaw=float(position[3]), omega=omega)


def replay(flight: RecordedFlight, **options) -> tuple[Array, Array, World]:
    """Fly the recording in a fresh world: firmware times (M,), true positions (M, 3), the world."""
    start = flight.record["start"]
    world = World([airframe("cf21")], np.array([[start["x"], start["y"], 0.0]]), np.array([start["yaw"]]), **options)
    firmware = Replayer(flight, world)
    world.attach([firmware])
    path = []
    for k in range(len(firmware.times)):
        world.advance(k * TICK)
        path.append(world.positions[0])
    return firmware.times, np.array(path), world
