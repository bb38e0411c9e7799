"""JSON Schemas of Foxglove's well-known messages: the fields that we fill (https://docs.foxglove.dev/docs/sdk/schemas).

Foxglove and Lichtblick know these messages by their schema's name, which therefore has to be exact.
"""

from __future__ import annotations

from typing import Any


def _object(title: str = "", description: str = "", /, **properties: dict[str, Any]) -> dict[str, Any]:
    about = {"title": f"foxglove.{title}"} if title else {}
    if description:
        about["description"] = description
    return {**about, "type": "object", "properties": properties}


def _list(items: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": items}


def _named(title: str, *names: str) -> dict[str, Any]:
    """An enumeration: names by number."""
    return {
        "title": f"foxglove.{title}",
        "oneOf": [{"title": name, "const": value} for value, name in enumerate(names)],
    }


_TEXT, _NUMBER, _INTEGER = {"type": "string"}, {"type": "number"}, {"type": "integer"}
_COUNT = {"type": "integer", "minimum": 0}
_FLAG = {"type": "boolean"}
_TIME = {"type": "object", "title": "time", "properties": {"sec": _COUNT, "nsec": _COUNT}}
_DURATION = {"type": "object", "title": "duration", "properties": {"sec": _INTEGER, "nsec": _COUNT}}
_VECTOR2 = _object("Vector2", x=_NUMBER, y=_NUMBER)
_VECTOR3 = _object("Vector3", x=_NUMBER, y=_NUMBER, z=_NUMBER)
_POINT3 = _object("Point3", x=_NUMBER, y=_NUMBER, z=_NUMBER)
_QUATERNION = _object("Quaternion", x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_COLOR = _object("Color", r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_POSE = _object("Pose", position=_VECTOR3, orientation=_QUATERNION)
_LINE_TYPE = _named("LineType", "LINE_STRIP", "LINE_LOOP", "LINE_LIST")
_NUMERIC_TYPE = _named(
    "NumericType", "UNKNOWN", "UINT8", "INT8", "UINT16", "INT16", "UINT32", "INT32", "FLOAT32", "FLOAT64"
)
_LEVEL = _named("LogLevel", "UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL")

_STAMPED: dict[str, dict[str, Any]] = {"timestamp": _TIME, "frame_id": _TEXT}
_VERTICES: dict[str, dict[str, Any]] = {
    "points": _list(_POINT3),
    "color": _COLOR,
    "colors": _list(_COLOR),
    "indices": _list(_COUNT),
}

_LINE = _object(
    "LinePrimitive",
    type=_LINE_TYPE,
    pose=_POSE,
    thickness=_NUMBER,
    scale_invariant=_FLAG,
    **_VERTICES,
)
_TRIANGLES = _object("TriangleListPrimitive", pose=_POSE, **_VERTICES)
_SPHERE = _object("SpherePrimitive", pose=_POSE, size=_VECTOR3, color=_COLOR)
_LABEL = _object(
    "TextPrimitive",
    pose=_POSE,
    billboard=_FLAG,
    font_size=_NUMBER,
    scale_invariant=_FLAG,
    color=_COLOR,
    text=_TEXT,
)
_ENTITY = _object(
    "SceneEntity",
    **_STAMPED,
    id=_TEXT,
    lifetime=_DURATION,
    frame_locked=_FLAG,
    metadata=_list(_object("KeyValuePair", key=_TEXT, value=_TEXT)),
    spheres=_list(_SPHERE),
    lines=_list(_LINE),
    triangles=_list(_TRIANGLES),
    texts=_list(_LABEL),
)
_DELETION = _object("SceneEntityDeletion", timestamp=_TIME, type=_COUNT, id=_TEXT)
_TRANSFORM = _object(
    "FrameTransform",
    timestamp=_TIME,
    parent_frame_id=_TEXT,
    child_frame_id=_TEXT,
    translation=_VECTOR3,
    rotation=_QUATERNION,
)
_PACKED = _object("PackedElementField", name=_TEXT, offset=_COUNT, type=_NUMERIC_TYPE)

SCHEMAS: dict[str, dict[str, Any]] = {
    "foxglove.PoseInFrame": _object(
        "PoseInFrame",
        "A timestamped pose for an object or reference frame in 3D space",
        **_STAMPED,
        pose=_POSE,
    ),
    "foxglove.FrameTransforms": _object(
        "FrameTransforms", "An array of FrameTransform messages", transforms=_list(_TRANSFORM)
    ),
    "foxglove.SceneUpdate": _object(
        "SceneUpdate",
        "An update to the entities displayed in a 3D scene",
        deletions=_list(_DELETION),
        entities=_list(_ENTITY),
    ),
    "foxglove.Grid": _object(
        "Grid",
        "A 2D grid of data",
        **_STAMPED,
        pose=_POSE,
        column_count=_COUNT,
        cell_size=_VECTOR2,
        row_stride=_COUNT,
        cell_stride=_COUNT,
        fields=_list(_PACKED),
        data={"type": "string", "contentEncoding": "base64"},
    ),
    "foxglove.Log": _object(
        "Log",
        "A log message",
        timestamp=_TIME,
        level=_LEVEL,
        message=_TEXT,
        name=_TEXT,
        file=_TEXT,
        line=_COUNT,
    ),
}
