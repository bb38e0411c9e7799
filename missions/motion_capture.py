"""How motion capture sees the robots, and in which frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from missions.fields import Vector, field


@dataclass(frozen=True)
class MotionCapture:
    """How motion capture sees the robots, and in which frame."""

    tracking: Literal["bodies", "positions", "markers"] = field(
        "what is known of each robot: the pose of a rigid body of its name; only the body's position; or one marker, "
        "unlabelled, told from the others by the pad it starts on and by its motion. Without orientations robots have "
        "to stand on their pads looking along the x axis",
        default="bodies",
    )
    height: float = field(
        "how far above the centre of a level robot the marker, or the body's origin, is",
        unit="m",
        at_least=-0.2,
        at_most=0.2,
        default=0.0,
    )
    up: Literal["z", "y"] = field(
        "axis of the system that points up; with y, its -z becomes the world's y", default="z"
    )
    unit: float = field(
        "length of the system's unit; 0.001 for millimetres", unit="m", above=0.0, at_most=1000.0, default=1.0
    )
    origin: Vector = field(
        "(x, y, z) of the system's origin in the world of the mission", unit="m", default=(0.0, 0.0, 0.0), items=(3, 3)
    )
    yaw: float = field(
        "direction of the system's x axis in the world, counter-clockwise",
        unit="rad",
        at_least=-6.2832,
        at_most=6.2832,
        default=0.0,
    )
    latency: float = field(
        "time from exposure to arrival of a frame where the system does not say it",
        unit="s",
        at_least=0.0,
        at_most=0.2,
        default=0.0,
    )
