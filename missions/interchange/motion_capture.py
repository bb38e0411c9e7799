"""Read Crazyswarm2's ``motion_capture.yaml``: which system, and where it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from missions.fields import Vector
from missions.interchange.crazyflies import Branch
from missions.mappings import FrozenMapping
from missions.yamltree import parse_yaml

SYSTEMS = ("vicon", "optitrack", "qualisys", "vrpn")  # those ``ergoflie fly --mocap`` names
_KNOWN = ("type", "hostname", "topics", "marker_configurations")


@dataclass(frozen=True)
class MotionCapture:
    """What the file says.

    Attributes:
        system: its type, as in the file. hostname: of its server.
        markers: by marker configuration, the points of its markers on the robot (x, y, z) [m].
        notes: what was left behind.
    """

    system: str
    hostname: str
    markers: Mapping[str, tuple[Vector, ...]]
    notes: tuple[str, ...]


def parse_motion_capture(text: str, file: str) -> MotionCapture:
    """Read a ``motion_capture.yaml``.

    Args:
        text: the file's text.
        file: its name, for messages.

    Raises:
        MissionError: not YAML, or without a type; with the line.
    """
    root = Branch(parse_yaml(text, file=file), "", file)
    settings = root.branch("/motion_capture_tracking").branch("ros__parameters")
    system = settings.text("type")
    if system is None:
        raise root.error("missing key 'type'; allowed: a motion-capture system", "/motion_capture_tracking")
    notes = [f"{file}: {key}" for key in settings.items if key not in _KNOWN]
    if system not in SYSTEMS:
        notes.append(f"{file}: type {system!r} is not among those tested here: {', '.join(SYSTEMS)}")
    markers = {item.key: _points(item) for item in settings.branch("marker_configurations").branches()}
    return MotionCapture(system, settings.text("hostname") or "", FrozenMapping(markers), tuple(notes))


def _points(configuration: Branch) -> tuple[Vector, ...]:
    """Markers of a configuration, its offset added (motion_capture_tracking_node.cpp)."""
    offset = configuration.vector("offset") or (0.0, 0.0, 0.0)
    points = configuration.branch("points")
    placed = [points.vector(key) or (0.0, 0.0, 0.0) for key in points.items]
    return tuple(tuple(a + b for a, b in zip(point, offset, strict=True)) for point in placed)
