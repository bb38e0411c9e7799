"""How the plan becomes polynomials and bytes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from missions.fields import Vector, field


@dataclass(frozen=True)
class FixedYaw:
    """All robots keep one heading."""

    angle: float = field(
        "heading, counter-clockwise from the x axis", unit="rad", at_least=-6.2832, at_most=6.2832, default=0.0
    )
    type: Literal["fixed"] = "fixed"


@dataclass(frozen=True)
class PathYaw:
    """Robots look where they fly to."""

    type: Literal["path"] = "path"


@dataclass(frozen=True)
class FacingYaw:
    """Robots look at a point."""

    point: Vector = field("(x, y) of what they look at", unit="m", items=(2, 2))
    type: Literal["facing"] = "facing"


Yaw = FixedYaw | PathYaw | FacingYaw


@dataclass(frozen=True)
class TrajectorySettings:
    """How the plan becomes bytes."""

    tolerance: float = field(
        "largest deviation of what flies from the plan at the same time", unit="m", above=0.0, at_most=0.5, default=0.01
    )
    encoding: Literal["auto", "poly4d", "compressed"] = field("trajectory memory format", default="auto")
    yaw: Yaw = field("where robots look while they search", default=FixedYaw())
    yaw_rate: float = field(
        "fastest turn about the vertical; the default is a tenth of what motion capture follows, gentle on yaw torque",
        unit="rad/s",
        above=0.0,
        at_most=20.0,
        default=1.0,
    )
