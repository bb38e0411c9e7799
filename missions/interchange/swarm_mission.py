"""A mission file for the robots of a Crazyswarm2 set-up: complete, commented, ready to be planned and edited."""

from __future__ import annotations

import itertools
import json
import math
import re
from collections.abc import Iterable, Mapping

from missions.errors import MissionError
from missions.interchange.crazyflies import Swarm, SwarmRobot
from missions.interchange.motion_capture import MotionCapture
from missions.loader import parse_mission
from missions.schema import Flight

_CONTROLLERS = {1.0: "pid", 2.0: "mellinger"}
_OURS = {  # parameters every flight sets by itself, or that are commands
    "stabilizer.controller": "",
    "stabilizer.estimator": "every flight uses the Kalman filter",
    "commander.enHighLevel": "every flight uses the high-level commander",
    "kalman.resetEstimation": "every flight resets the filter by itself",
}
_AROUND = 1.0  # [m] of room round the robots
_SEPARATION, _LEAST_SEPARATION = 0.3, 0.2  # [m]
_MOST_VOLTAGE = 4.3  # [V], bound of flight.battery_minimum


def swarm_mission(swarm: Swarm, capture: MotionCapture | None, *, name: str, file: str) -> tuple[str, tuple[str, ...]]:
    """Write the mission.

    Robots start where they stand, above their pads. Workspace, horizon and information are a beginning, to be edited.

    Args:
        swarm: the robots.
        capture: the motion capture, for a comment.
        name: of the mission.
        file: what to call the set-up in messages and comments.

    Returns:
        The file's text, which loads, and what could not be taken over, one line each.

    Raises:
        MissionError: robots too close together to take off, or otherwise no mission.
    """
    robots = swarm.robots
    separation = _separation(robots, file)
    parameters, differing = _shared(robots)
    controller, notes = _controller(parameters, file)
    notes = [*swarm.notes, *(capture.notes if capture else ()), *notes]
    notes += [f"firmware_params {key}: {_OURS[key]}" for key in parameters if _OURS.get(key)]
    notes += [f"firmware_params {key}: differs between robots; missions have one value for all" for key in differing]
    notes += [
        f"robots.{r.name}: voltage_critical {r.voltage:g} V; flights here start with {Flight.battery_minimum:g} V"
        for r in robots
        if r.voltage is not None and r.voltage < Flight.battery_minimum
    ]
    notes += [f"robots.{r.name}.initial_position: height {r.position[2]:g} m" for r in robots if r.position[2] != 0.0]
    kept = {key: value for key, value in parameters.items() if key not in _OURS}
    tracking, untracked = _tracking(robots, capture)
    notes += untracked
    lines = [
        *_head(file, capture),
        "schema_version: 1",
        f"name: {name}",
        "",
        *_place(robots),
        "",
        "# Who searches; each starts above the place it stands on.",
        "robots:",
        *(f"  - {{name: {_quoted(r.name)}, start: {_point(r.position)}, uri: {_quoted(r.uri)}}}" for r in robots),
        "",
        "limits: {acceleration: 0.5, speed: 1.0, " + f"separation: {separation:g}" + "}  # [m/s²] an axis, [m/s], [m]",
        "",
        "# Who has to meet: nobody yet. See missions/policies for the others.",
        "connectivity: {policy: none}",
        "",
        *_flight(robots, controller, kept),
        *tracking,
    ]
    if notes:
        lines += ["", f"# Not taken over from {_shown(file)}:", *(f"#   {_shown(note)}" for note in notes)]
    text = "\n".join(lines) + "\n"
    _check(text, file)
    return text, tuple(notes)


def _check(text: str, file: str) -> None:
    """What is left to refuse, e.g. two robots with one address: said of the file that the user wrote."""
    try:
        parse_mission(text, path=file, read_file=lambda _: b"")  # it names no file
    except MissionError as error:
        raise MissionError(f"these robots make no mission: {error.reason}", where=error.where, file=file) from None


def _head(file: str, capture: MotionCapture | None) -> list[str]:
    lines = [
        f"# Made from {_shown(file)} by 'ergoflie import crazyswarm2'. Edit what is searched, how long, and the limits."
    ]
    if capture is not None:
        host = f" --mocap-host {_shown(capture.hostname)}" if capture.hostname else ""
        lines.append(f"# Fly with: ergoflie fly PLAN --mocap {_shown(capture.system)}{host}")
    return lines


def _place(robots: Iterable[SwarmRobot]) -> list[str]:
    """Workspace, horizon and information."""
    positions = [robot.position for robot in robots]
    lower = [math.floor(10.0 * (min(p[axis] for p in positions) - _AROUND)) / 10.0 for axis in (0, 1)]
    upper = [math.ceil(10.0 * (max(p[axis] for p in positions) + _AROUND)) / 10.0 for axis in (0, 1)]
    return [
        f"# The box that is searched: {_AROUND:g} m round where the robots stand. Make it what your room allows.",
        f"workspace: {{lower: {_point(lower)}, upper: {_point(upper)}}}  # [m]",
        "horizon: {duration: 30.0, dt: 0.1}  # [s]",
        "information: {type: uniform}  # where there is something to see; or gaussians, image, array",
    ]


def _flight(robots: tuple[SwarmRobot, ...], controller: str, parameters: Mapping[str, float]) -> list[str]:
    voltage = _takeoff_voltage(robots)
    brushless = any(re.search("brushless|21b|bl$", robot.type.lower()) for robot in robots)
    lines = [
        "flight:",
        "  altitude: 0.6  # [m]",
        f"  airframe: {'cf21_brushless' if brushless else 'cf21'}  # judged by the robots' types; see airframes.yaml",
        f"  controller: {controller}",
    ]
    if voltage > Flight.battery_minimum:
        lines.append(f"  battery_minimum: {voltage:g}  # [V] voltage_critical")
    if parameters:
        lines += ["  parameters:", *(f"    {key}: {value:.9g}" for key, value in parameters.items())]
    return lines


def _tracking(robots: tuple[SwarmRobot, ...], capture: MotionCapture | None) -> tuple[list[str], list[str]]:
    """How robots are told apart: by single markers if all of them are, and what cannot be taken over."""
    configurations = {robot.marker for robot in robots}
    if configurations == {""}:
        return [], []
    known = capture.markers if capture else {}
    # Crazyswarm2's example names the single marker so; the file that defines it counts for more.
    single = {name for name in configurations if (len(known[name]) == 1 if name in known else "single" in name)}
    if single != configurations:
        shown = ", ".join(sorted(_shown(name) for name in configurations if name))
        return [], [
            f"markers ({shown}): robots are told apart by one marker each, all of them, or by rigid bodies of their "
            "names in the motion-capture system"
        ]
    heights = {round(point[2], 4) for name in configurations for point in known.get(name, ())}
    height = heights.pop() if len(heights) == 1 else 0.0
    comment = "# one marker a robot, told apart by pads and motion; [m] above its centre"
    return ["", f"motion_capture: {{tracking: markers, height: {height:g}}}  {comment}"], []


def _takeoff_voltage(robots: tuple[SwarmRobot, ...]) -> float:
    """What flights start with [V]: a critical voltage is meant in the air, so it may only make the default stricter."""
    critical = [robot.voltage for robot in robots if robot.voltage is not None]
    return min(max([Flight.battery_minimum, *critical]), _MOST_VOLTAGE)


def _separation(robots: tuple[SwarmRobot, ...], file: str) -> float:
    """The default, or what the pads leave."""
    least = _SEPARATION
    for one, other in itertools.combinations(robots, 2):
        distance = math.dist(one.position[:2], other.position[:2])
        if distance < _LEAST_SEPARATION:
            reason = (
                f"{one.name} and {other.name} stand {distance:.3g} m apart; allowed: at least {_LEAST_SEPARATION:g} [m]"
            )
            raise MissionError(reason, where=f"robots.{other.name}.initial_position", file=file)
        least = min(least, math.floor(100.0 * distance + 1e-6) / 100.0)
    return least


def _shared(robots: tuple[SwarmRobot, ...]) -> tuple[dict[str, float], list[str]]:
    """Parameters that are the same for all robots, and the names of those that are not."""
    names = list(dict.fromkeys(name for robot in robots for name in robot.parameters))
    values = {name: [robot.parameters.get(name) for robot in robots] for name in names}
    shared = {name: value[0] for name, value in values.items() if value[0] is not None and len(set(value)) == 1}
    return shared, [name for name in names if name not in shared]


def _controller(parameters: Mapping[str, float], file: str) -> tuple[str, list[str]]:
    value = parameters.get("stabilizer.controller", 2.0)  # Crazyswarm2's own default
    if value in _CONTROLLERS:
        return _CONTROLLERS[value], []
    return "mellinger", [f"firmware_params stabilizer.controller: {value:g} is neither pid (1) nor mellinger (2)"]


def _point(values: Iterable[float]) -> str:
    return f"[{', '.join(f'{value:.9g}' for value in itertools.islice(values, 2))}]"


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _shown(text: str) -> str:
    """Fit for a comment: one printable line."""
    return "".join(character if character.isprintable() else "?" for character in text)
