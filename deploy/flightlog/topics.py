"""Every topic of a plan file or a flight log, in one table: schema, fields with units, frame, clock, rate.

Names of Foxglove's own schemas are used where one exists, so that Foxglove and Lichtblick draw them without set-up;
everything else is ``ergoflie.*``. All channels are JSON with a JSON Schema. SI units; world frame (z up);
quaternions x, y, z, w, body to world. A value that is not known is null.

Clocks: every record's log time is the *flight clock* (``deploy.clock``), written as nanoseconds since the Unix epoch
(``Clock.epoch + t``). Where a drone stamped the data itself, its own tick stands in the record beside it.
"""

from __future__ import annotations

import functools
import json
from dataclasses import dataclass
from enum import Enum
from typing import Any

WORLD = "world"


class Kind(Enum):
    """JSON shape of a field."""

    NUMBER = "number"
    INTEGER = "integer"
    TEXT = "string"
    VECTOR = "vector"  # {"x", "y", "z"}
    QUATERNION = "quaternion"  # {"x", "y", "z", "w"}
    TEXTS = "strings"
    NUMBERS = "numbers"


@dataclass(frozen=True)
class Field:
    """One field of a record: what it is and in which unit."""

    name: str
    kind: Kind
    unit: str
    doc: str


@dataclass(frozen=True)
class Topic:
    """One row of the table.

    Attributes:
        pattern: topic name; ``{robot}`` stands for a robot's name.
        schema: schema name in the MCAP file.
        fields: fields of our own schemas; empty for Foxglove's, whose JSON Schema is in :data:`FOXGLOVE_SCHEMAS`.
        frame: frame of positions, or empty.
        clock: what the log time is.
        rate: how often it is written.
        doc: what it holds.
    """

    pattern: str
    schema: str
    fields: tuple[Field, ...]
    frame: str
    clock: str
    rate: str
    doc: str


_POSITION = Field("position", Kind.VECTOR, "m", "position")
_VELOCITY = Field("velocity", Kind.VECTOR, "m/s", "velocity")
_TICK = Field("tick", Kind.INTEGER, "ms", "the drone's own time stamp; null when it has none")

TOPICS: tuple[Topic, ...] = (
    Topic(
        "/{robot}/pose",
        "foxglove.PoseInFrame",
        (),
        WORLD,
        "flight clock at measurement",
        "flight.pose_rate",
        "pose from the motion capture; identity orientation when only the position is known",
    ),
    Topic(
        "/{robot}/estimate",
        "ergoflie.Estimate",
        (_POSITION, _VELOCITY, Field("attitude", Kind.VECTOR, "rad", "roll, pitch, yaw"), _TICK),
        WORLD,
        "flight clock at reception",
        "flight.log_rate",
        "the drone's own state estimate, by telemetry",
    ),
    Topic(
        "/{robot}/setpoint",
        "ergoflie.Setpoint",
        (_POSITION, _VELOCITY, Field("yaw_rate", Kind.NUMBER, "rad/s", "yaw rate"), _TICK),
        WORLD,
        "flight clock at reception",
        "flight.log_rate",
        "what the drone's commander asks of its controller (ctrltarget), by telemetry",
    ),
    Topic(
        "/{robot}/reference",
        "ergoflie.Reference",
        (_POSITION, _VELOCITY),
        WORLD,
        "flight clock",
        "flight.log_rate, during the mission",
        "where the certified trajectory is at that time",
    ),
    Topic(
        "/{robot}/battery",
        "ergoflie.Battery",
        (
            Field("voltage", Kind.NUMBER, "V", "battery voltage under the present load"),
            Field("level", Kind.NUMBER, "%", "charge level as the firmware sees it"),
            Field("state", Kind.INTEGER, "", "pm.state: 0 battery, 1 charging, 2 charged, 3 low power, 4 shutdown"),
        ),
        "",
        "flight clock at reception",
        "flight.log_rate",
        "battery, by telemetry",
    ),
    Topic(
        "/{robot}/link",
        "ergoflie.Link",
        (
            Field("latency_ms", Kind.NUMBER, "ms", "round trip of a ping"),
            Field("quality", Kind.NUMBER, "%", "share of acknowledged packets"),
            Field("rssi", Kind.NUMBER, "dBm", "received signal strength"),
            Field("sent", Kind.INTEGER, "", "packets sent so far"),
            Field("received", Kind.INTEGER, "", "packets received so far"),
            Field("lost", Kind.INTEGER, "", "packets known to be lost so far"),
        ),
        "",
        "flight clock",
        "1 to 10 Hz",
        "radio link statistics",
    ),
    Topic(
        "/{robot}/supervisor",
        "ergoflie.Supervisor",
        (
            Field("bits", Kind.INTEGER, "", "supervisor.info bit field"),
            Field("names", Kind.TEXTS, "", "names of the bits that are set"),
        ),
        "",
        "flight clock at reception",
        "flight.log_rate",
        "state of the firmware's supervisor",
    ),
    Topic(
        "/{robot}/motors",
        "ergoflie.Motors",
        (Field("power", Kind.NUMBERS, "0..65535", "command of each motor"),),
        "",
        "flight clock at reception",
        "flight.log_rate",
        "motor commands",
    ),
    Topic(
        "/events",
        "ergoflie.Event",
        (
            Field("phase", Kind.TEXT, "", "phase of the flight"),
            Field("robot", Kind.TEXT, "", "robot concerned; empty for all"),
            Field("level", Kind.TEXT, "", "info, warning or fault"),
            Field("name", Kind.TEXT, "", "what kind of event: phase, mission_start, mission_end, …"),
            Field("text", Kind.TEXT, "", "one line for a person"),
            Field("value", Kind.NUMBER, "", "a figure, in the unit the text names"),
        ),
        "",
        "flight clock",
        "as they happen",
        "everything that happened",
    ),
    Topic("/log", "foxglove.Log", (), "", "flight clock", "as they happen", "the events as log lines; drop reports"),
    Topic(
        "/mocap",
        "ergoflie.Mocap",
        (
            Field("rate", Kind.NUMBER, "Hz", "frames per second over the last second"),
            Field("age", Kind.NUMBER, "s", "age of the newest frame"),
            Field("latency_ms", Kind.NUMBER, "ms", "from measurement to use, mean over the frames of the last second"),
            Field("worst_latency_ms", Kind.NUMBER, "ms", "the same at its longest"),
            Field("stale", Kind.INTEGER, "", "frames of the last second that were too old to be sent on"),
            Field("sent", Kind.NUMBER, "Hz", "poses sent over the last second, to all drones together"),
            Field("bodies", Kind.INTEGER, "", "bodies in the newest frame"),
            Field("points", Kind.INTEGER, "", "unlabelled markers in the newest frame"),
            Field("missing", Kind.TEXTS, "", "robots without a pose in it"),
            Field("doubtful", Kind.TEXTS, "", "those of them whose marker could be another's"),
            Field("refused", Kind.TEXTS, "", "robots whose newest poses could not be true and were not sent"),
        ),
        "",
        "flight clock",
        "1 to 10 Hz",
        "health of the motion capture",
    ),
    Topic(
        "/mocap/points",
        "ergoflie.Points",
        (Field("points", Kind.NUMBERS, "m", "x, y, z of one marker after the other, unlabelled"),),
        WORLD,
        "flight clock at measurement",
        "every frame of a flight with unlabelled markers",
        "what the capture system saw; the tracker can be replayed on it",
    ),
    Topic(
        "/plan/{robot}/pose",
        "foxglove.PoseInFrame",
        (),
        WORLD,
        "time since the start of the search",
        "10 Hz",
        "the certified trajectory, in plan files",
    ),
)

_BY_SHAPE = {topic.pattern: topic for topic in TOPICS}


@functools.lru_cache(maxsize=4096)
def find_topic(name: str) -> tuple[Topic, str]:
    """The row a topic name belongs to, and its robot (empty for topics without one).

    Raises:
        ValueError: no row has this name.
    """
    parts = name.split("/")
    if name in _BY_SHAPE and "{robot}" not in name:
        return _BY_SHAPE[name], ""
    for at in (1, 2):
        if at < len(parts) and parts[at]:
            shape = "/".join([*parts[:at], "{robot}", *parts[at + 1 :]])
            if shape in _BY_SHAPE:
                return _BY_SHAPE[shape], parts[at]
    raise ValueError(f"unknown topic '{name}'; known: {', '.join(_BY_SHAPE)}")


def json_schema(topic: Topic) -> str:
    """JSON Schema of the topic's records, with units in the descriptions."""
    if topic.schema in FOXGLOVE_SCHEMAS:
        return json.dumps(FOXGLOVE_SCHEMAS[topic.schema], sort_keys=True)
    properties = {
        field.name: {**_SHAPES[field.kind], "description": f"{field.doc} [{field.unit}]" if field.unit else field.doc}
        for field in topic.fields
    }
    return json.dumps(
        {"title": topic.schema, "description": topic.doc, "type": "object", "properties": properties}, sort_keys=True
    )


def _numbers(*names: str) -> dict[str, Any]:
    return {"type": "object", "properties": {name: {"type": "number"} for name in names}}


_SHAPES: dict[Kind, dict[str, Any]] = {
    Kind.NUMBER: {"type": ["number", "null"]},
    Kind.INTEGER: {"type": ["integer", "null"]},
    Kind.TEXT: {"type": "string"},
    Kind.VECTOR: _numbers("x", "y", "z"),
    Kind.QUATERNION: _numbers("x", "y", "z", "w"),
    Kind.TEXTS: {"type": "array", "items": {"type": "string"}},
    Kind.NUMBERS: {"type": "array", "items": {"type": "number"}},
}
_TIMESTAMP = {
    "type": "object",
    "title": "time",
    "properties": {"sec": {"type": "integer", "minimum": 0}, "nsec": {"type": "integer", "minimum": 0}},
}

# The fields of Foxglove's documented schemas that we fill.
FOXGLOVE_SCHEMAS: dict[str, dict[str, Any]] = {
    "foxglove.PoseInFrame": {
        "title": "foxglove.PoseInFrame",
        "description": "A timestamped pose for an object or reference frame in 3D space",
        "type": "object",
        "properties": {
            "timestamp": _TIMESTAMP,
            "frame_id": {"type": "string"},
            "pose": {
                "title": "foxglove.Pose",
                "type": "object",
                "properties": {
                    "position": {"title": "foxglove.Vector3", **_numbers("x", "y", "z")},
                    "orientation": {"title": "foxglove.Quaternion", **_numbers("x", "y", "z", "w")},
                },
            },
        },
    },
    "foxglove.Log": {
        "title": "foxglove.Log",
        "description": "A log message",
        "type": "object",
        "properties": {
            "timestamp": _TIMESTAMP,
            "level": {
                "title": "foxglove.LogLevel",
                "oneOf": [
                    {"title": name, "const": value}
                    for value, name in enumerate(("UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"))
                ],
            },
            "message": {"type": "string"},
            "name": {"type": "string"},
            "file": {"type": "string"},
            "line": {"type": "integer", "minimum": 0},
        },
    },
}
