"""JSON Schemas of mission and other files, generated from the records, so that editors complete and check them."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

from missions.airframes import airframe_names
from missions.records import alternatives, discriminator, is_required, nesting, public_fields
from missions.schema import Mission

JsonSchema = dict[str, Any]
_BOUNDS = {"at_least": "minimum", "above": "exclusiveMinimum", "at_most": "maximum", "below": "exclusiveMaximum"}
_NOTHING: Mapping[str, Sequence[str]] = MappingProxyType({})
_TYPES = {float: "number", int: "integer", bool: "boolean", str: "string"}


def json_schema() -> JsonSchema:
    """JSON Schema (draft 2020-12) of a mission file; units and meanings are in the descriptions."""
    return schema_of(Mission, "ergoflie mission", choices={"airframe": airframe_names()})


def schema_of(
    record: type, title: str, *, choices: Mapping[str, Sequence[str]] = _NOTHING, either: Collection[str] = ()
) -> JsonSchema:
    """JSON Schema (draft 2020-12) of the files that are read into a record.

    Args:
        record: what a whole file becomes.
        title: of the schema.
        choices: what is allowed in texts of which the records only say that they are texts, by the field's name.
        either: fields of which every record that has them all needs exactly one.
    """
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": title}
    return head | _Generator(choices, frozenset(either)).record(record)


@dataclass(frozen=True)
class _Generator:
    """Makes schemas of records; see :func:`schema_of`."""

    choices: Mapping[str, Sequence[str]]
    either: frozenset[str]

    def record(self, record: type) -> JsonSchema:
        hints = typing.get_type_hints(record)
        fields = public_fields(record)
        tag = discriminator(record)
        properties = {item.name: self._field(item, hints[item.name]) for item in fields}
        if tag:
            properties[tag[0]] = {"const": tag[1], "description": "which kind this is"}
        schema: JsonSchema = {
            "type": "object",
            "description": " ".join((record.__doc__ or "").split()),
            "properties": properties,
            "additionalProperties": False,
        }
        if required := [item.name for item in fields if is_required(item)]:
            schema["required"] = required
        if self.either and self.either <= properties.keys():
            schema["oneOf"] = [{"required": [name]} for name in sorted(self.either)]
        return schema

    def _field(self, item: dataclasses.Field[Any], hint: Any) -> JsonSchema:  # noqa: ANN401 - hints have no common type
        meta = item.metadata
        unit = f" [{meta['unit']}]" if meta.get("unit") else ""
        schema: JsonSchema = self._value(hint, meta) | {"description": meta.get("doc", "") + unit}
        if item.name in self.choices:
            schema["enum"] = list(self.choices[item.name])
        stated = isinstance(item.default, str | int | float) and item.name != "schema_version"
        if stated and item.default in schema.get("enum", [item.default]):
            schema["default"] = item.default
        return schema

    def _value(self, hint: Any, meta: Mapping[str, Any]) -> JsonSchema:  # noqa: ANN401 - hints have no common type
        choices = alternatives(hint)
        if dataclasses.is_dataclass(choices[0]):
            records = [self.record(choice) for choice in choices if choice is not types.NoneType]
            return records[0] if len(records) == 1 else {"oneOf": records}
        if len(choices) == 1:
            return self._single(hint, meta)
        return {"anyOf": [self._single(choice, meta) for choice in sorted(choices, key=nesting)]}

    def _single(self, hint: Any, meta: Mapping[str, Any]) -> JsonSchema:  # noqa: ANN401 - hints have no common type
        if hint is types.NoneType:
            return {"type": "null"}
        origin = typing.get_origin(hint)
        if origin is tuple:
            least, most = meta.get("items") or (None, None)
            inner = {key: value for key, value in meta.items() if key != "items"}
            sizes = {} if least is None else {"minItems": least, "maxItems": most}
            return {"type": "array", "items": self._value(typing.get_args(hint)[0], inner)} | sizes
        if origin is Mapping:
            return {"type": "object", "additionalProperties": self._value(typing.get_args(hint)[1], meta)}
        if origin is Literal:
            return {"enum": list(typing.get_args(hint))}
        limits = {name: meta[key] for key, name in _BOUNDS.items() if meta.get(key) is not None}
        pattern = {"pattern": f"^{meta['pattern']}$"} if meta.get("pattern") else {}
        return {"type": _TYPES[hint]} | (limits if hint in (int, float) else {}) | pattern
