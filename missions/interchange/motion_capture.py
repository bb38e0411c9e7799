"""Read Crazyswarm2's ``motion_capture.yaml``: which system, and where it is."""

from __future__ import annotations

from dataclasses import dataclass

from missions.interchange.crazyflies import Branch
from missions.yamltree import parse_yaml

SYSTEMS = ("vicon", "optitrack", "qualisys", "vrpn")  # those ``ergoflie fly --mocap`` names
_KNOWN = ("type", "hostname", "topics")


@dataclass(frozen=True)
class MotionCapture:
    """Attributes: system: its type, as in the file. hostname: of its server. notes: what was left behind."""

    system: str
    hostname: str
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
    return MotionCapture(system, settings.text("hostname") or "", tuple(notes))
