"""The JSON Schema of mission files, generated from the records, so that editors complete and check them."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Mapping
from typing import Any, Literal

from missions.airframes import airframe_names
from missions.records import alternatives, discriminator, is_required, nesting, public_fields
from missions.schema import Mission

JsonSchema = dict[str, Any]
_BOUNDS = {"at_least": "minimum", "above": "exclusiveMinimum", "at_most": "maximum", "below": "exclusiveMaximum"}
_TYPES = {float: "number", int: "integer", bool: "boolean", str: "string"}


def json_schema() -> JsonSchema:
    """JSON Schema (draft 2020-12) of a mission file; units and meanings are in the descriptions."""
    head = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "ergoflie mission",
    }
    return head | _record(Mission)


def _record(record: type) -> JsonSchema:
    hints = typing.get_type_hints(record)
    fields = public_fields(record)
    tag = discriminator(record)
    properties = {item.name: _field(item, hints[item.name]) for item in fields}
    if tag:
        properties[tag[0]] = {"const": tag[1], "description": "which kind this is"}
    schema: JsonSchema = {
        "type": "object",
        "description": " ".join((record.__doc__ or "").split()),
        "properties": properties,
        "additionalProperties": False,
    }
    required = [item.name for item in fields if is_required(item)]
    return schema | ({"required": required} if required else {})


def _field(item: dataclasses.Field[Any], hint: Any) -> JsonSchema:  # noqa: ANN401 - type hints have no common type
    meta = item.metadata
    unit = f" [{meta['unit']}]" if meta.get("unit") else ""
    schema: JsonSchema = _value(hint, meta) | {"description": meta.get("doc", "") + unit}
    if item.name == "airframe":
        schema["enum"] = list(airframe_names())
    if isinstance(item.default, str | int | float) and item.name != "schema_version":
        schema["default"] = item.default
    return schema


def _value(hint: Any, meta: Mapping[str, Any]) -> JsonSchema:  # noqa: ANN401 - type hints have no common type
    choices = alternatives(hint)
    if dataclasses.is_dataclass(choices[0]):
        records = [_record(choice) for choice in choices if choice is not types.NoneType]
        return records[0] if len(records) == 1 else {"oneOf": records}
    if len(choices) == 1:
        return _single(hint, meta)
    return {"anyOf": [_single(choice, meta) for choice in sorted(choices, key=nesting)]}


def _single(hint: Any, meta: Mapping[str, Any]) -> JsonSchema:  # noqa: ANN401 - type hints have no common type
    if hint is types.NoneType:
        return {"type": "null"}
    origin = typing.get_origin(hint)
    if origin is tuple:
        least, most = meta.get("items") or (None, None)
        inner = {key: value for key, value in meta.items() if key != "items"}
        sizes = {} if least is None else {"minItems": least, "maxItems": most}
        return {"type": "array", "items": _value(typing.get_args(hint)[0], inner)} | sizes
    if origin is Mapping:
        return {"type": "object", "additionalProperties": _value(typing.get_args(hint)[1], meta)}
    if origin is Literal:
        return {"enum": list(typing.get_args(hint))}
    limits = {name: meta[key] for key, name in _BOUNDS.items() if meta.get(key) is not None}
    pattern = {"pattern": f"^{meta['pattern']}$"} if meta.get("pattern") else {}
    return {"type": _TYPES[hint]} | (limits if hint in (int, float) else {}) | pattern
