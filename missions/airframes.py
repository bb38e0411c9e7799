"""Airframes: mass, motors, drag and battery of the drones a mission can name; the numbers are in ``airframes.yaml``."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources

from missions.errors import MissionError
from missions.mappings import FrozenMapping
from missions.records import RecordReader, did_you_mean
from missions.schema import field
from missions.yamltree import MappingNode, parse_yaml

_THRUST_COMMAND_MAX = 65535  # uint16 of the firmware's motor commands
GRAVITY = 9.81  # [m/s²], the firmware's GRAVITY_MAGNITUDE


@dataclass(frozen=True)
class Airframe:
    """Physical constants of one kind of Crazyflie; body frame x forward, y left, z up."""

    description: str = field("what it is")
    mass: float = field("take-off mass", unit="kg", above=0.0)
    arm: float = field("centre to motor axis", unit="m", above=0.0)
    radius: float = field("smallest sphere around the drone, propellers included", unit="m", above=0.0)
    inertia: tuple[float, ...] = field("principal moments of inertia x, y, z", unit="kg m²", above=0.0, items=(3, 3))
    motor_thrust_max: float = field("thrust of one motor at full command", unit="N", above=0.0)
    torque_per_thrust: float = field("reaction torque of a propeller per thrust", unit="m", above=0.0)
    motor_tau_up: float = field("time constant of rising thrust", unit="s", above=0.0)
    motor_tau_down: float = field("time constant of falling thrust", unit="s", above=0.0)
    drag: tuple[float, ...] = field("linear drag x, y, z of the body frame", unit="N s/m", at_least=0.0, items=(3, 3))
    tilt_limit: float = field("largest comfortable tilt", unit="rad", above=0.0, below=1.57)
    rate_limit: tuple[float, ...] = field("largest rates about body x, y, z", unit="rad/s", above=0.0, items=(3, 3))
    speed_limit: float = field("largest speed a mission may ask for", unit="m/s", above=0.0)
    acceleration_limit: float = field("largest acceleration a mission may ask for", unit="m/s²", above=0.0)
    battery_capacity: float = field("charge of a full battery", unit="mAh", above=0.0)
    hover_power: float = field("electrical power in hover", unit="W", above=0.0)
    voltage_full: float = field("open-circuit voltage of a full battery", unit="V", above=0.0)
    voltage_empty: float = field("open-circuit voltage of an empty battery", unit="V", above=0.0)
    internal_resistance: float = field("battery, leads and connector", unit="ohm", at_least=0.0)

    @property
    def thrust_per_count(self) -> float:
        """Thrust of one motor per count of its 16-bit command [N]."""
        return self.motor_thrust_max / _THRUST_COMMAND_MAX

    @property
    def hover_tilt(self) -> float:
        """Tilt at which all motors at full command just hold the height [rad]."""
        return math.acos(min(1.0 / self.thrust_to_weight, 1.0))

    @property
    def thrust_to_weight(self) -> float:
        """Thrust of all motors at full command over the weight."""
        return 4.0 * self.motor_thrust_max / (self.mass * GRAVITY)


@functools.cache
def _airframes() -> Mapping[str, Airframe]:
    name = "missions/airframes.yaml"
    text = resources.files("missions").joinpath("airframes.yaml").read_text(encoding="utf-8")
    root = parse_yaml(text, file=name)
    if not isinstance(root, MappingNode):
        raise MissionError("allowed: a mapping of airframes", file=name)
    reader = RecordReader(name)
    return FrozenMapping({key: reader.read_record(node, Airframe, key) for key, node in root.items.items()})


def airframe_names() -> tuple[str, ...]:
    """Every airframe a mission can name."""
    return tuple(_airframes())


def airframe(name: str) -> Airframe:
    """Look up an airframe, e.g. ``cf21``.

    Raises:
        MissionError: no such airframe; the message lists the known ones.
    """
    known = _airframes()
    if name not in known:
        hint = did_you_mean(name, known)
        raise MissionError(f"unknown airframe {name!r}; known airframes: {', '.join(known)}{hint}")
    return known[name]
