"""Nodes to frozen records: one reader for all, driven by type hints and :func:`missions.schema.field` metadata.

A record with a field ``type`` or ``policy`` is one of several kinds; the file has to say which, also where only one
kind exists so far, so that files written today stay unambiguous when a second kind is added.
"""

from __future__ import annotations

import dataclasses
import difflib
import re
import types
import typing
from collections.abc import Iterable, Mapping
from typing import Any, Literal, TypeVar, Union

from missions import scalars
from missions.errors import MissionError
from missions.mappings import FrozenMapping
from missions.yamltree import MappingNode, Node, ScalarNode, SequenceNode

Record = TypeVar("Record")
DISCRIMINATORS = ("type", "policy", "fault")


# ------------------------------------------------------------------------------------- looking at records


def public_fields(record: type) -> list[dataclasses.Field[Any]]:
    """Fields a file may set, in order."""
    return [item for item in dataclasses.fields(record) if not item.metadata.get("internal")]


def is_required(item: dataclasses.Field[Any]) -> bool:
    """Whether a file must set the field: it has no default, or it tells kinds of records apart."""
    return item.name in DISCRIMINATORS or (
        item.default is dataclasses.MISSING and item.default_factory is dataclasses.MISSING
    )


def alternatives(hint: Any) -> tuple[Any, ...]:  # noqa: ANN401 - type hints have no common type
    """Members of a union; the hint itself if it is none."""
    return typing.get_args(hint) if typing.get_origin(hint) in (Union, types.UnionType) else (hint,)


def discriminator(record: type) -> tuple[str, str] | None:
    """Name and value of the field that tells this kind of record from others; None if it has none."""
    for item in public_fields(record):
        if item.name in DISCRIMINATORS:
            return item.name, str(item.default)
    return None


def nesting(hint: Any) -> int:  # noqa: ANN401 - type hints have no common type
    """How many lists deep a value of this type is."""
    return 1 + nesting(typing.get_args(hint)[0]) if typing.get_origin(hint) is tuple else 0


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """A hint for a misspelt word, or nothing."""
    close = difflib.get_close_matches(word.lower(), list(known), n=1)
    return f" (did you mean {close[0]!r}?)" if close else ""


# ---------------------------------------------------------------------------------------------- reading


class RecordReader:
    """Reads records out of one file and remembers the line of every value.

    Attributes:
        file: name of the file, for messages.
        lines: line of every value that was read, by its path, e.g. ``robots[2].uri``.
    """

    def __init__(self, file: str) -> None:
        self.file = file
        self.lines: dict[str, int] = {}

    def error(self, reason: str, where: str) -> MissionError:
        """An error at a path; the line is the value's own or, for absent values, its nearest parent's."""
        path = where
        while path and path not in self.lines:
            path = path[: max(path.rfind("."), path.rfind("["), 0)]
        return MissionError(reason, where=where, file=self.file, line=self.lines.get(path))

    def read_record(self, node: Node, record: type[Record], where: str = "") -> Record:
        """Read a mapping into a record.

        Raises:
            MissionError: an unknown or missing key, a wrong type, or a number outside its bounds.
        """
        mapping = self._mapping(node, where)
        fields = {item.name: item for item in public_fields(record)}
        for key, line in mapping.lines.items():
            self.lines[_join(where, key)] = line
        for key in mapping.items:
            if key not in fields:
                tag = discriminator(record)
                kind = f" of {tag[0]} {tag[1]}" if tag else ""
                reason = f"unknown key{did_you_mean(key, fields)}; known keys{kind}: {', '.join(fields)}"
                raise self.error(reason, _join(where, key))
        for name, item in fields.items():
            if is_required(item) and name not in mapping.items:
                raise self.error(f"missing key {name!r}: {describe_field(item)}", where)
        hints = typing.get_type_hints(record)
        values = {
            key: self._value(value, hints[key], _join(where, key), fields[key].metadata)
            for key, value in mapping.items.items()
        }
        return record(**values)

    def _mapping(self, node: Node, where: str) -> MappingNode:
        self.lines.setdefault(where, node.line)
        if isinstance(node, MappingNode):
            return node
        raise self.error(f"got {_kind(node)}; allowed: a mapping of 'key: value' lines", where)

    def _value(self, node: Node, hint: Any, where: str, meta: Mapping[str, Any]) -> Any:  # noqa: ANN401
        self.lines.setdefault(where, node.line)
        choices = alternatives(hint)
        if isinstance(node, ScalarNode) and scalars.is_null(node) and types.NoneType in choices:
            return None
        choices = tuple(choice for choice in choices if choice is not types.NoneType)
        if all(dataclasses.is_dataclass(choice) for choice in choices):
            return self._one_of(node, choices, where)
        if len(choices) > 1:
            fitting = [choice for choice in choices if nesting(choice) == _depth(node)]
            if not fitting:
                raise self.error(f"got {_kind(node)}; allowed: {meta['doc']}{_unit(meta)}", where)
            choices = (fitting[0],)
        hint = choices[0]
        origin = typing.get_origin(hint)
        if origin is tuple:
            return self._list(node, typing.get_args(hint)[0], where, meta)
        if origin is Mapping:
            return self._table(node, typing.get_args(hint)[1], where, meta)
        return self._scalar(node, hint, where, meta)

    def _one_of(self, node: Node, records: tuple[type, ...], where: str) -> Any:  # noqa: ANN401
        tags = {discriminator(record): record for record in records}
        if None in tags:
            return self.read_record(node, records[0], where)
        mapping = self._mapping(node, where)
        key = next(tag[0] for tag in tags if tag)
        kinds = {tag[1]: record for tag, record in tags.items() if tag}
        allowed = ", ".join(kinds)
        if key not in mapping.items:
            raise self.error(f"missing key {key!r}; allowed: {allowed}", where)
        value = mapping.items[key]
        self.lines[_join(where, key)] = mapping.lines[key]
        if isinstance(value, ScalarNode) and value.text in kinds:
            return self.read_record(node, kinds[value.text], where)
        hint = did_you_mean(value.text, kinds) if isinstance(value, ScalarNode) else ""
        raise self.error(f"got {_kind(value)}; allowed: {allowed}{hint}", _join(where, key))

    def _list(self, node: Node, item: Any, where: str, meta: Mapping[str, Any]) -> tuple[Any, ...]:  # noqa: ANN401
        if not isinstance(node, SequenceNode):
            raise self.error(f"got {_kind(node)}; allowed: a list{_unit(meta)}", where)
        least, most = meta.get("items") or (0, len(node.items))
        if not least <= len(node.items) <= most:
            allowed = f"{least}" if least == most else f"{least} to {most}"
            raise self.error(f"got {len(node.items)} items; allowed: {allowed}{_unit(meta)}", where)
        inner = {**meta, "items": None}  # the length is that of the outer list
        return tuple(self._value(child, item, f"{where}[{i}]", inner) for i, child in enumerate(node.items))

    def _table(
        self,
        node: Node,
        item: Any,  # noqa: ANN401 - type hints have no common type
        where: str,
        meta: Mapping[str, Any],
    ) -> Mapping[str, Any]:
        mapping = self._mapping(node, where)
        for key, line in mapping.lines.items():
            self.lines[_join(where, key)] = line
        return FrozenMapping(
            {key: self._value(child, item, _join(where, key), meta) for key, child in mapping.items.items()}
        )

    def _scalar(self, node: Node, hint: Any, where: str, meta: Mapping[str, Any]) -> Any:  # noqa: ANN401
        if not isinstance(node, ScalarNode):
            raise self.error(f"got {_kind(node)}; allowed: {_expected(hint)}{_unit(meta)}", where)
        if typing.get_origin(hint) is Literal:
            allowed = typing.get_args(hint)
            if node.text in allowed:
                return node.text
            hinted = did_you_mean(node.text, allowed)
            raise self.error(f"got {_kind(node)}; allowed: {', '.join(allowed)}{hinted}", where)
        try:
            value = _CONVERTERS[hint](node)
        except scalars.ScalarError as error:
            raise self.error(f"{error}{_unit(meta)}", where) from None
        if isinstance(value, int | float) and not isinstance(value, bool) and not _within(value, meta):
            raise self.error(f"got {node.text}; allowed: {bounds(meta)}{_unit(meta)}", where)
        if isinstance(value, str) and meta.get("pattern") and not re.fullmatch(meta["pattern"], value):
            raise self.error(f"got {value[:80]!r}; allowed: {meta['doc']}", where)
        return value


_CONVERTERS: dict[Any, Any] = {
    float: scalars.to_float,
    int: scalars.to_int,
    bool: scalars.to_bool,
    str: scalars.to_text,
}
_EXPECTED = {float: "a number", int: "a whole number", bool: "true or false", str: "text"}


def describe_field(item: dataclasses.Field[Any]) -> str:
    """Meaning, unit and bounds of a field in one line."""
    meta = item.metadata
    parts = [meta.get("doc") or f"which kind; {item.default}"]
    parts += [f"[{meta['unit']}]"] if meta.get("unit") else []
    parts += [f"({bounds(meta)})"] if bounds(meta) else []
    return " ".join(parts)


def bounds(meta: Mapping[str, Any]) -> str:
    """The allowed range in words, e.g. ``above 0, at most 10``; empty if there is none."""
    words = (("above", "above"), ("at_least", "at least"), ("below", "below"), ("at_most", "at most"))
    return ", ".join(f"{word} {meta[key]:g}" for key, word in words if meta.get(key) is not None)


def _within(value: float, meta: Mapping[str, Any]) -> bool:
    above, at_least, below, at_most = (meta.get(key) for key in ("above", "at_least", "below", "at_most"))
    return (
        (above is None or value > above)
        and (at_least is None or value >= at_least)
        and (below is None or value < below)
        and (at_most is None or value <= at_most)
    )


def _join(where: str, key: str) -> str:
    key = key if len(key) <= 80 else key[:77] + "..."
    key = key if key.isprintable() else repr(key)  # a message is one line, whatever the key holds
    return f"{where}.{key}" if where else key


def _unit(meta: Mapping[str, Any]) -> str:
    return f" [{meta['unit']}]" if meta.get("unit") else ""


def _expected(hint: Any) -> str:  # noqa: ANN401 - type hints have no common type
    return _EXPECTED.get(hint) or ", ".join(map(str, typing.get_args(hint)))


def _kind(node: Node) -> str:
    if isinstance(node, ScalarNode):
        return scalars.describe(node)
    return "a list" if isinstance(node, SequenceNode) else "a mapping"


def _depth(node: Node) -> int:
    """How many lists deep the node is, judged by first items; a mapping is as deep as nothing else."""
    depth = 0
    while isinstance(node, SequenceNode):
        depth += 1
        if not node.items:
            break
        node = node.items[0]
    return -1 if isinstance(node, MappingNode) else depth
