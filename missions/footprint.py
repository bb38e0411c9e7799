"""What a robot sees of the floor, or of the mission's object, from where it is: the footprint of its sensor.

A mission with footprints has its information on the floor, in two axes, wherever the robots fly above it; one with
cameras has it on its object's surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from missions.fields import Vector, field


@dataclass(frozen=True)
class PointFootprint:
    """The point of the floor right below."""

    type: Literal["point"] = "point"


@dataclass(frozen=True)
class DiscFootprint:
    """All within a distance of the point below, whatever the height."""

    radius: float = field("of the disc", unit="m", above=0.0, at_most=100.0)
    rim: float = field(
        "what the sensor sees at the outline, of what it sees at the centre; in between as a Gaussian",
        above=0.0,
        at_most=1.0,
        default=1.0,
    )
    type: Literal["disc"] = "disc"


@dataclass(frozen=True)
class ConeFootprint:
    """What a downward camera with a round picture sees: much and coarsely from above, little and finely from below."""

    slope: float = field("k_h: radius on the floor per metre of height", above=0.0, at_most=10.0)
    rim: float = field(
        "what the sensor sees at the outline, of what it sees at the centre; in between as a Gaussian",
        above=0.0,
        at_most=1.0,
        default=1.0,
    )
    tilts: bool = field("fixed to the body, so that it looks aside where the drone accelerates", default=False)
    type: Literal["cone"] = "cone"


@dataclass(frozen=True)
class WindowFootprint:
    """What a level downward camera with a rectangular picture sees."""

    slopes: Vector = field(
        "half length and half width of the picture on the floor per metre of height",
        above=0.0,
        at_most=10.0,
        items=(2, 2),
    )
    yaw: float = field(
        "direction of its length, counter-clockwise from x", unit="rad", at_least=-6.2832, at_most=6.2832, default=0.0
    )
    type: Literal["window"] = "window"


@dataclass(frozen=True)
class CameraFootprint:
    """What a level camera with a round picture sees of the mission's object: it looks where the robot's yaw does."""

    half_angle: float = field("from the middle of the picture to its edge", unit="rad", at_least=0.05, at_most=1.5)
    pitch: float = field("how far it looks up; negative: down", unit="rad", at_least=-1.5, at_most=1.5, default=0.0)
    rim: float = field(
        "what it sees at the edge of the picture, of what it sees in the middle; in between as a Gaussian",
        above=0.0,
        at_most=1.0,
        default=1.0,
    )
    reach: float | None = field(
        "distance at which it sees e^-½ of what its picture shows, for want of resolution; default: it sees all of it",
        unit="m",
        above=0.0,
        at_most=100.0,
        default=None,
    )
    grazing: float = field(
        "steepest angle to the surface's normal at which it still sees it",
        unit="rad",
        at_least=0.1,
        at_most=1.5708,
        default=1.3963,
    )
    type: Literal["camera"] = "camera"


Footprint = PointFootprint | DiscFootprint | ConeFootprint | WindowFootprint | CameraFootprint
