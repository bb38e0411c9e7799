"""What LED rings show: how wide each robot sees. A narrow footprint is bright and warm, a wide one dim and cold.

Brightness is the size of the narrowest footprint of the mission as a share of this one's, never below :data:`DIMMEST`
(after the drones of Zheng et al., Fig. 1 and 11, whose lights show their footprints on the floor).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeAlias

from missions.footprint import CameraFootprint, ConeFootprint, DiscFootprint, Footprint, WindowFootprint

if TYPE_CHECKING:
    from missions.schema import Mission

Colour: TypeAlias = tuple[int, int, int]
LIGHT_PERIOD = 0.5  # [s] between colours; the ring itself fades from one to the next
DARK: Colour = (0, 0, 0)
NARROW: Colour = (255, 140, 0)
WIDE: Colour = (0, 80, 255)
DIMMEST = 0.15


def lit(mission: Mission) -> tuple[str, ...]:
    """Names of the robots whose LED ring shows what they see."""
    sees = zip(mission.robots, mission.footprints, strict=False)  # none without footprints
    return tuple(robot.name for robot, footprint in sees if "led_ring" in robot.decks and spread(footprint, 1.0) > 0.0)


def spread(footprint: Footprint, distance: float) -> float:
    """How far one sees to each side from a height above the floor, or a distance from an object [m]; 0: a point."""
    distance = max(distance, 0.0)
    if isinstance(footprint, DiscFootprint):
        return footprint.radius
    if isinstance(footprint, ConeFootprint):
        return footprint.slope * distance
    if isinstance(footprint, WindowFootprint):
        return math.sqrt(footprint.slopes[0] * footprint.slopes[1]) * distance
    if isinstance(footprint, CameraFootprint):
        return math.tan(footprint.half_angle) * distance
    return 0.0


def colour(wide: float, narrowest: float, widest: float) -> Colour:
    """Red, green, blue, 0 to 255 each, of a spread between the narrowest and the widest of a mission [m]."""
    wide = min(max(wide, narrowest), widest)
    share = 0.0 if widest <= narrowest else math.log(wide / narrowest) / math.log(widest / narrowest)
    brightness = max(DIMMEST, narrowest / wide)
    hue = [(1.0 - share) * a + share * b for a, b in zip(NARROW, WIDE, strict=True)]
    red, green, blue = (round(255.0 * brightness * part / max(hue)) for part in hue)
    return red, green, blue
