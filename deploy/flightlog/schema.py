"""What a row of the table of topics is made of, and the JSON Schema that follows from it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from enum import Enum
from typing import Any

from deploy.flightlog.foxglove import SCHEMAS


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
        fields: fields of our own schemas; empty for Foxglove's, see ``foxglove.py``.
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


def json_schema(topic: Topic) -> str:
    """JSON Schema of the topic's records, with units in the descriptions."""
    if topic.schema in SCHEMAS:
        return json.dumps(SCHEMAS[topic.schema], sort_keys=True)
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
