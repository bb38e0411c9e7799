"""The recorded flights, flown again by the modelled firmware: its log blocks against those of the recordings."""

import functools
import math
import struct

import numpy as np
import pytest

from deploy.radio.simulated.crazyflie import SimulatedCrazyflie
from deploy.radio.simulated.physics.sensors import SensorNoise
from deploy.radio.simulated.physics.world import TICK, World
from deploy.radio.simulated.toc import log_toc, param_toc
from missions.airframes import airframe
from tests.recordings import recording

FLIGHTS = ("pid_circle", "pid_waypoints", "mellinger_eight")
ACTIVE, FLYING = 0x0100, 0x0010  # bits of supervisor.info
PORTS = {"supervisor": 0x91, "param_write": 0x22}  # everything else is for the high-level commander


class Flight:
    """One recorded flight and what the model logs when it gets the same packets at the same times."""

    def __init__(self, name):
        self.record = recording("flight_logs")[name]
        blocks = [self.record["log_pos"], self.record["log_state"]]
        self.recorded = [
            {column: np.array(values) for column, values in zip(b["columns"], np.transpose(b["rows"]), strict=True)}
            for b in blocks
        ]
        commands = [c for c in self.record["commands"] if not c["hex"].startswith("4300")]  # resets: see _prepare
        takeoff = next(c["t_ms"] for c in commands if c["command"] == "takeoff")
        self.begin = (takeoff - 1000) // 10 / 100
        start = self.record["start"]
        self.world = World(
            [airframe("cf21")],
            np.array([[start["x"], start["y"], 0.0]]),
            np.array([start["yaw"]]),
            noise=SensorNoise.none(),
        )
        self.drone = SimulatedCrazyflie("cf", hardware=False, uptime=self.begin)
        self.world.attach([self.drone])
        self.answers, rows = [], [[], []]
        self.drone.attach(lambda port, channel, data: self._arrived(rows, port, channel, data))
        self._prepare(start, blocks)
        self._fly(commands)
        self.logged = [
            dict(zip(block["columns"], np.array(got, dtype=float).T, strict=True))
            for block, got in zip(blocks, rows, strict=True)
        ]

    def at_recorded_times(self, block, column):
        """The model's values when the recording has its own, and those."""
        mine, theirs = self.logged[block], self.recorded[block]
        during = (theirs["t_ms"] > mine["t_ms"][0]) & (theirs["t_ms"] < mine["t_ms"][-1])
        values = np.unwrap(mine[column], period=360.0) if column == "stateEstimate.yaw" else mine[column]  # [deg]
        return np.interp(theirs["t_ms"][during], mine["t_ms"], values), theirs[column][during]

    def steered(self, block):
        """Where the high-level commander steers in both, and has done so for a moment."""
        stamps = self.recorded[block]["t_ms"]
        mine, theirs = self.logged[1], self.recorded[1]
        both = [
            np.interp(stamps, t["t_ms"], (t["supervisor.info"].astype(int) & ACTIVE > 0).astype(float)) == 1.0
            for t in (mine, theirs)
        ]
        during = (stamps > self.logged[block]["t_ms"][0]) & (stamps < self.logged[block]["t_ms"][-1])
        return (both[0] & both[1])[during]

    def _arrived(self, rows, port, channel, data):
        if (port, channel) == (5, 2):
            values = struct.unpack("<6f" if data[0] == 0 else "<5fH", data[4:])
            rows[data[0]].append((int.from_bytes(data[1:4], "little"), *values))
        elif port == 8:
            self.answers.append(data.hex())

    def _prepare(self, start, blocks):
        params, logs = param_toc(False).index, log_toc(False)
        for name, value in (("X", start["x"]), ("Y", start["y"]), ("Yaw", start["yaw"])):
            self.drone.receive(0x22, struct.pack("<Hf", params[f"kalman.initial{name}"], value))
        self.drone.receive(0x22, struct.pack("<HB", params["kalman.resetEstimation"], 1))
        image = bytes.fromhex(self.record["trajectory"]["image_hex"])
        for address in range(0, len(image), 24):
            self.drone.receive(0x42, struct.pack("<BI", 0, address) + image[address : address + 24])
        for number, block in enumerate(blocks):
            indices = [logs.index[name] for name in block["columns"][1:]]
            variables = b"".join(struct.pack("<BH", 0x11 * logs.entries[i].type, i) for i in indices)
            self.drone.receive(0x51, bytes([6, number]) + variables)
            self.drone.receive(0x51, bytes([3, number, 2]))

    def _fly(self, commands):
        ticks = 0
        end = self.record["supervisor_info_changes"][-1][0] / 1e3 + 1.0
        while self.begin + ticks * TICK < end:
            while commands and commands[0]["t_ms"] / 1e3 <= self.begin + ticks * TICK:
                command = commands.pop(0)
                self.drone.receive(PORTS.get(command["command"], 0x80), bytes.fromhex(command["hex"]))
            self.drone.receive(0x60, struct.pack("<fff", *self.world.positions[0]))
            ticks += 1
            self.world.advance(ticks * TICK)


def turned(degrees):
    """The smaller way round."""
    return np.abs((degrees + 180.0) % 360.0 - 180.0)


def lasting(changes):
    """Without states of a supervisor step or two: whether a log sample or a poll hit them is chance."""
    ends = [t for t, _ in changes[1:]] + [math.inf]
    return [change for change, end in zip(changes, ends, strict=True) if end - change[0] > 100.0]


@functools.cache
def flown(name):
    return Flight(name)


@pytest.mark.parametrize("name", FLIGHTS)
def test_return_codes_are_the_recorded_ones(name):
    flight = flown(name)
    assert flight.answers == [c["answer_hex"] for c in flight.record["commands"] if "answer_hex" in c]


@pytest.mark.parametrize("name", FLIGHTS)
def test_logged_targets_are_the_recorded_ones(name):
    """Within what flies by in 10 ms (a packet acts 1 to 10 ms after its time) and how far the drones are apart."""
    flight = flown(name)
    for block, column, bound in (
        *((0, f"ctrltarget.{axis}", 0.02) for axis in "xyz"),
        *((1, f"ctrltarget.v{axis}", 0.03) for axis in "xyz"),
        (1, "ctrltarget.yaw", 1.0),  # a rate [°/s]
    ):
        mine, theirs = flight.at_recorded_times(block, column)
        apart = np.abs(mine - theirs)
        assert apart[flight.steered(block)].max() < bound, column


@pytest.mark.parametrize("name", FLIGHTS)
def test_logged_estimates_are_the_recorded_ones(name):
    flight = flown(name)
    for axis in "xyz":
        mine, theirs = flight.at_recorded_times(0, f"stateEstimate.{axis}")
        apart = np.abs(mine - theirs)[flight.steered(0)]
        assert apart.mean() < 0.015, axis
        assert apart.max() < 0.05, axis
    mine, theirs = flight.at_recorded_times(1, "stateEstimate.yaw")
    assert turned(mine - theirs)[flight.steered(1)].max() < 3.0


@pytest.mark.parametrize("name", FLIGHTS)
def test_logged_supervisor_goes_through_the_recorded_states(name):
    flight = flown(name)
    t, info = flight.logged[1]["t_ms"], flight.logged[1]["supervisor.info"].astype(int)
    mine = lasting([(t[0], info[0])] + [(b, y) for b, x, y in zip(t[1:], info[:-1], info[1:], strict=True) if x != y])
    theirs = lasting([(stamp, int(bits, 16)) for stamp, bits in flight.record["supervisor_info_changes"]])
    assert [hex(bits) for _, bits in mine] == [hex(bits) for _, bits in theirs]
    for (a, bits), (b, _) in zip(mine[1:], theirs[1:], strict=True):
        assert a == pytest.approx(b, abs=150.0), hex(bits)
