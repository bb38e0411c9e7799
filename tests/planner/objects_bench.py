"""Small missions around objects, for tests: a mission's text and files, made here."""

from __future__ import annotations

import numpy as np

from missions.loader import parse_mission
from missions.make_objects import chair, ply, statue

MISSION = """
schema_version: 1
name: around
workspace: {lower: [-1.5, -1.5, 0.2], upper: [1.5, 1.5, 1.8]}
horizon: {duration: 10.0, dt: 0.1}
object: {file: thing.ply, near: 0.3, OBJECT}
footprint: {type: camera, half_angle: 0.5, CAMERA}
information: {INFORMATION}
basis: {functions_per_axis: 4}
robots:
  - {name: cf1, start: [1.0, 0.1, 0.7]}
  - {name: cf2, start: [-1.0, 0.1, 0.7]}
limits: {acceleration: 0.5, speed: 0.6, vertical_separation: 0.6}
solver: {starts: 1}
"""


def text(item="samples: 200", camera="pitch: 0.0", information="type: uniform"):
    return MISSION.replace("OBJECT", item).replace("CAMERA", camera).replace("INFORMATION", information)


def read(data, mission=None, **parts):
    """A mission around what is in the bytes of ``thing.ply`` (or whatever the mission names)."""
    return parse_mission(mission or text(**parts), path="m.yaml", read_file=lambda name: data)


def box(sides=(0.4, 0.3, 0.6), lower=(-0.2, -0.15, 0.0)):
    """A closed box: vertices (8, 3) and faces (12, 3)."""
    corner = np.array([[i & 1, (i >> 1) & 1, i >> 2] for i in range(8)], dtype=float)
    quads = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
    return np.array(lower) + corner * np.array(sides), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def as_ply(surface):
    return ply(*surface).encode()


def as_cloud(points):
    head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n" + "".join(f"property float {a}\n" for a in "xyz")
    return (head + "end_header\n" + "\n".join(" ".join(map(str, p)) for p in points) + "\n").encode()


STATUE, CHAIR, BOX = as_ply(statue()), as_ply(chair()), as_ply(box())
