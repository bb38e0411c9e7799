"""The footprints a mission asks for."""

from __future__ import annotations

import math

from missions.footprint import CameraFootprint, ConeFootprint, PointFootprint
from missions.footprint import DiscFootprint as DiscRecord
from missions.footprint import Footprint as FootprintRecord
from planner.footprint.base import Footprint
from planner.footprint.disc import DiscFootprint
from planner.footprint.outline import Disc, Window
from planner.footprint.point import Point
from planner.footprint.polar import PolarFootprint
from planner.footprint.tilt import TiltedCone
from planner.footprint.window import WindowFootprint


def footprint_of(record: FootprintRecord, dt: float) -> Footprint:
    """A mission's footprint as the metric takes it.

    Args:
        record: as written in the mission.
        dt: time between positions [s], from which a body's tilt follows.

    Raises:
        TypeError: a camera, whose footprint is on an object (:mod:`planner.surface`).
    """
    if isinstance(record, PointFootprint):
        return Point()
    if isinstance(record, DiscRecord):
        return DiscFootprint(Disc(radius=record.radius), record.rim)
    if isinstance(record, ConeFootprint):
        if record.tilts:
            return PolarFootprint(TiltedCone(math.atan(record.slope), dt), record.rim)
        return DiscFootprint(Disc(slope=record.slope), record.rim)
    if isinstance(record, CameraFootprint):
        raise TypeError("a camera looks at an object, not at the floor")
    length, width = record.slopes
    if record.yaw == 0.0:
        return WindowFootprint((length, width))
    return PolarFootprint(Window((length, width), record.yaw))
