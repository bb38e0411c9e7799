"""A real process that flies real-time drones of another process over UDP, and is killed with SIGKILL."""

import json
import subprocess
import sys
import threading
from dataclasses import dataclass

import numpy as np

from deploy.flightlog.reader import read_log
from deploy.planfile import write_plan
from missions.loader import parse_mission
from planner.trajectory.encode import encode
from planner.trajectory.piecewise import PiecewisePolynomial
from tests.deploy.flight_bench import SMOOTH, certified

TEXT = """
schema_version: 1
name: killed
workspace: {{lower: [0.0, 0.0], upper: [2.0, 2.0]}}
horizon: {{duration: 4.0, dt: 0.1}}
information: {{type: gaussians, components: [{{mean: [1.0, 1.0], covariance: 0.1}}]}}
robots:
  - {{name: cf1, pad: [0.5, 0.4], start: [0.5, 0.7]{uris[0]}}}
  - {{name: cf2, pad: [1.3, 0.4], start: [1.3, 0.7]{uris[1]}}}
limits: {{acceleration: 1.0, speed: 1.0, separation: 0.3}}
flight: {{altitude: 0.5, takeoff_duration: 1.5, landing_duration: 1.5, settle_time: 0.5, transfer_speed: 0.45}}
safety: {{on_host_loss: {on_host_loss}}}
"""
SHIFT = (0.2, 0.7)  # m, of every search
LAUNCH = 60.0  # s of patience with processes that start
WATCHED = {"continue": 6.0, "motor_stop": 3.0}  # s after the kill: the longest move; a second of silence and the fall
NEAR, STILL = 0.1, 0.05  # m, m/s
EARLIEST, LATEST = 0.7, 1.4  # s: a second after a keepalive up to 0.2 s old, seen ten times a second
IN_THE_AIR = ("transferring", "settling", "on mission", "holding", "returning")


@dataclass(frozen=True)
class Row:
    """All drones at one moment: the simulation's time [s], positions (N, 3) [m], states in words, who is connected."""

    t: float
    position: np.ndarray
    states: tuple[str, ...]
    connected: tuple[bool, ...]


class Sim:
    """``ergoflie sim --json``, and everything it says."""

    def __init__(self, mission):
        command = [sys.executable, "-m", "deploy.cli", "sim", str(mission), "--port", "0", "--json"]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self.rows, self.uris, self._said = [], (), threading.Condition()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()
        with self._said:
            assert self._said.wait_for(lambda: self.rows, LAUNCH), "the simulation does not start"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()
        self._reader.join()
        self._process.stdout.close()

    def wait(self, condition, patience):
        """Until the newest row satisfies a condition; at most so long [s]."""
        with self._said:
            assert self._said.wait_for(lambda: condition(self.rows[-1]), patience), "the drones' clock stands still"

    def _read(self):
        for line in self._process.stdout:
            said = json.loads(line)
            drones = said["drones"]
            self.uris = tuple(drone["uri"] for drone in drones)
            position = np.array([drone["position"] for drone in drones])
            states, connected = (tuple(drone[key] for drone in drones) for key in ("state", "connected"))
            with self._said:
                self.rows.append(Row(said["t"], position, states, connected))
                self._said.notify_all()


def mission_text(on_host_loss="continue", uris=()):
    """The mission, with these URIs."""
    return TEXT.format(on_host_loss=on_host_loss, uris=[f', uri: "{uri}"' for uri in uris] or ["", ""])


def plan_for(uris, on_host_loss):
    """A certified plan for drones at these URIs."""
    mission = parse_mission(mission_text(on_host_loss, uris), path="killed.yaml", read_file={}.__getitem__)
    return certified(mission, {robot.name: encode(_move(robot, mission)) for robot in mission.robots})


def fly(plan, folder):
    """``ergoflie fly``, in a process of its own."""
    path = folder / "killed.plan.mcap"
    write_plan(path, plan)
    command = [sys.executable, "-m", "deploy.cli", "fly", str(path), "--yes", "-o", str(folder / "logs")]
    return subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def _move(robot, mission):
    duration = mission.horizon.duration
    coefficients = np.zeros((1, 4, 8))
    for axis, (begin, shift) in enumerate(zip(robot.start, SHIFT, strict=True)):
        coefficients[0, axis] = shift * SMOOTH * duration ** -np.arange(8.0)
        coefficients[0, axis, 0] += begin
    coefficients[0, 2, 0] = mission.flight.altitude
    return PiecewisePolynomial(np.array([duration]), coefficients)


@dataclass(frozen=True)
class Fate:
    """What became of drones whose host was killed.

    Attributes:
        phase: the flight was in, by its log. at: when it was killed, by the drones' clock [s].
        after: what they did then, in words. problems: what of it the README does not say.
    """

    phase: str
    at: float
    after: str
    problems: tuple[str, ...]


def kill(on_host_loss, seconds, folder):
    """Kill a flight so long after its drones were first connected to [s], and see what the drones do."""
    mission = folder / "mission.yaml"
    mission.write_text(mission_text(on_host_loss))
    with Sim(mission) as sim:
        plan = plan_for(sim.uris, on_host_loss)
        with fly(plan, folder) as process:
            sim.wait(lambda row: any(row.connected) or process.poll() is not None, LAUNCH)
            assert process.poll() is None, process.communicate()[0]
            sim.wait(lambda row, begin=sim.rows[-1].t: row.t >= begin + seconds, 2.0 * seconds + LAUNCH)
            process.kill()
            before = len(sim.rows) - 1
            process.communicate()
        sim.wait(lambda row: row.t >= sim.rows[before].t + WATCHED[on_host_loss], LAUNCH)
        rows = sim.rows[before:]
    (path,) = (folder / "logs").glob("*.mcap*")
    log = read_log(path)
    phases = [event.text for event in log.events if event.name == "phase"]
    problems = [] if log.flight_plan.mission == plan.mission else ["the log does not hold the plan"]
    if path.suffix != ".part" and phases[-1] != "landed":
        problems.append(f"{path.name}: a log that was never closed")
    judged = _left_alone if on_host_loss == "continue" else _stopped
    return Fate(phases[-1], rows[0].t, _words(rows), (*problems, *judged(rows, phases, plan)))


def _left_alone(rows, phases, plan):
    """Everybody comes to rest where he was sent last, and hovers, or stands."""
    if phases[-1] in ("aborting", "aborted"):  # a slow computer: then it was none of the plan's places
        return
    places = _places(plan)
    speed = np.linalg.norm(rows[-1].position - rows[-4].position, axis=1) / (rows[-1].t - rows[-4].t)
    for i, name in enumerate(plan.trajectories):
        here, state = rows[-1].position[i], rows[-1].states[i]
        x, y, z = here
        where = f"{name} at ({x:.2f}, {y:.2f}, {z:.2f}) m, {state}"
        if speed[i] > STILL:
            yield f"{where}, moves at {speed[i]:.2f} m/s"
        if np.linalg.norm(places[name] - here, axis=1).min() > NEAR:
            yield f"{where}: not where anybody sent it"
        if (state == "flying") != (z > NEAR):
            yield where
        if phases[-1] in IN_THE_AIR and z < NEAR:
            yield f"{where}: it did not stay up"


def _stopped(rows, phases, plan):
    """Who flew is locked a second after the last keepalive, and on the ground when it has fallen."""
    for i, name in enumerate(plan.trajectories):
        if rows[0].states[i] != "flying":
            continue
        locked = next((row.t - rows[0].t for row in rows if row.states[i] == "locked"), np.inf)
        if not EARLIEST <= locked <= LATEST:
            yield f"{name} locked {locked:.1f} s after the kill"
        if rows[-1].position[i, 2] > NEAR or rows[-1].states[i] == "flying":
            yield f"{name} at {rows[-1].position[i, 2]:.2f} m in the end, {rows[-1].states[i]}"


def _places(plan):
    """Where each may be sent, (n, 3) [m]: pad and above it, start and end of its search, and the floor below that."""
    altitude = plan.mission.flight.altitude
    return {
        robot.name: np.array(
            [
                [*robot.pad, 0.0],
                [*robot.pad, altitude],
                [*robot.start, altitude],
                [*np.add(robot.start, SHIFT), altitude],
                [*np.add(robot.start, SHIFT), 0.0],
            ]
        )
        for robot in plan.mission.robots
    }


def _words(rows):
    lowest = ", ".join(f"{z:.2f}" for z in rows[-1].position[:, 2])
    return f"{'/'.join(rows[0].states)} then {'/'.join(rows[-1].states)} at {lowest} m"
