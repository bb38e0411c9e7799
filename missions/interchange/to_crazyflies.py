"""Write Crazyswarm2's ``crazyflies.yaml`` (version 3) for a mission's robots."""

from __future__ import annotations

import json

from missions.schema import Mission

_CONTROLLERS = {"pid": 1, "mellinger": 2}
_WARNING = 0.1  # [V] above the critical voltage


def crazyflies_yaml(mission: Mission) -> str:
    """The mission's robots as Crazyswarm2 reads them: on their pads, with the mission's on-board parameters.

    A robot without a URI is written with ``enabled: false``, for Crazyswarm2 could not connect to it.
    """
    flight = mission.flight
    return (
        "\n".join(
            [
                f"# The robots of mission {mission.name}, written by 'ergoflie export --crazyswarm2'.",
                "fileversion: 3",
                "robots:",
                *(line for k in range(len(mission.robots)) for line in _robot(mission, k)),
                "robot_types:",
                f"  {flight.airframe}:",
                "    motion_capture: {tracking: vendor}",
                "    big_quad: false",
                "    battery:",
                f"      voltage_warning: {flight.battery_minimum + _WARNING:.3g}",
                f"      voltage_critical: {flight.battery_minimum:.9g}",
                "all:",
                "  firmware_logging: {enabled: false}",
                "  firmware_params:",
                *_parameters(mission),
                "  reference_frame: world",
                "  broadcasts: {num_repeats: 15, delay_between_repeats_ms: 1}",
            ]
        )
        + "\n"
    )


def _robot(mission: Mission, index: int) -> list[str]:
    robot = mission.robots[index]
    x, y = (robot.pad or robot.start)[:2]
    return [
        f"  {json.dumps(robot.name)}:",
        f"    enabled: {'true' if robot.uri else 'false'}",
        f"    uri: {json.dumps(robot.uri)}",
        f"    initial_position: [{_number(x)}, {_number(y)}, 0]",
        f"    type: {mission.flight.airframe}",
    ]


def _parameters(mission: Mission) -> list[str]:
    """By group; the mission's own win, as they do in flight."""
    values: dict[str, float] = {
        "commander.enHighLevel": 1,
        "stabilizer.estimator": 2,
        "stabilizer.controller": _CONTROLLERS[mission.flight.controller],
        "locSrv.extPosStdDev": 0.001,
        "locSrv.extQuatStdDev": 0.05,
        **mission.flight.parameters,
    }
    groups: dict[str, list[str]] = {}
    for name, value in values.items():
        group, _, key = name.partition(".")
        groups.setdefault(group, []).append(f"      {json.dumps(key)}: {_number(value)}")
    return [line for group, lines in groups.items() for line in (f"    {json.dumps(group)}:", *lines)]


def _number(value: float) -> str:
    """Whole numbers without a point: ROS tells integers from floating point numbers. YAML 1.1 wants one before an e."""
    if float(value).is_integer() and abs(value) < 1e15:
        return str(int(value))
    text = repr(float(value))
    return text if "." in text else text.replace("e", ".0e")
