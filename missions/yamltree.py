"""Strict YAML: text to a tree of nodes that know their line, with nothing interpreted yet.

YAML 1.1 as most libraries read it is a trap for a safety file: ``on`` is a boolean, ``0012`` is ten, ``1:30`` is
ninety, ``1e-3`` is text, a repeated key silently wins, and nine lines of aliases fill the memory. Here a scalar stays
text until the schema says what it has to be (:mod:`missions.records`); aliases, tags, repeated keys, several documents
and absurd sizes are refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import yaml

from missions.errors import MissionError

MAX_CHARACTERS = 5_000_000
MAX_NODES = 200_000
MAX_DEPTH = 40

# The C parser is about ten times faster; wheels of PyYAML have it, builds from source may not.
_Loader: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)


@dataclass(frozen=True)
class ScalarNode:
    """A leaf: its text, and whether it was written without quotes."""

    text: str
    plain: bool
    line: int


@dataclass(frozen=True)
class SequenceNode:
    """A list."""

    items: tuple[Node, ...]
    line: int


@dataclass(frozen=True)
class MappingNode:
    """A mapping; ``lines`` holds the line of every key."""

    items: dict[str, Node]
    lines: dict[str, int]
    line: int


Node = ScalarNode | SequenceNode | MappingNode


def parse_yaml(text: str, *, file: str) -> Node:
    """Parse one YAML document.

    Args:
        text: the document.
        file: name of the file, for messages.

    Raises:
        MissionError: not YAML, or YAML that is refused (see the module's docstring).
    """
    if len(text) > MAX_CHARACTERS:
        raise MissionError(f"file too large: {len(text)} characters; allowed: {MAX_CHARACTERS}", file=file)
    try:
        text.encode()
        return _TreeBuilder(yaml.parse(text, Loader=_Loader), file).document()
    except UnicodeEncodeError as error:
        raise MissionError("not valid Unicode text", file=file, line=text.count("\n", 0, error.start) + 1) from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark else None
        problem = " ".join(part for part in (error.context, error.problem) if part)
        raise MissionError(f"not valid YAML: {problem}", file=file, line=line) from None
    except yaml.YAMLError as error:  # unprintable characters: the reader has an offset, no line
        problem = getattr(error, "reason", None) or "unreadable"
        raise MissionError(f"not valid YAML: {problem}", file=file) from None


class _TreeBuilder:
    """Folds the parser's events into nodes; iterating over events keeps deep nesting off the C stack."""

    def __init__(self, events: Iterator[yaml.Event], file: str) -> None:
        self._events = iter(events)
        self._file = file
        self._nodes = 0

    def document(self) -> Node:
        self._next()  # stream start
        if isinstance(self._next(), yaml.StreamEndEvent):
            raise MissionError("the file is empty", file=self._file)
        root = self._node(self._next(), depth=0)
        self._next()  # document end
        if not isinstance(event := self._next(), yaml.StreamEndEvent):
            raise self._error("a second YAML document ('---'); allowed: one", event)
        return root

    def _next(self) -> yaml.Event:
        return next(self._events)

    def _node(self, event: yaml.Event, depth: int) -> Node:
        self._check(event, depth)
        line = _line(event)
        if isinstance(event, yaml.ScalarEvent):
            return ScalarNode(event.value, plain=not event.style, line=line)
        if isinstance(event, yaml.SequenceStartEvent):
            items = []
            while not isinstance(event := self._next(), yaml.SequenceEndEvent):
                items.append(self._node(event, depth + 1))
            return SequenceNode(tuple(items), line)
        return self._mapping(line, depth)

    def _mapping(self, line: int, depth: int) -> MappingNode:
        items: dict[str, Node] = {}
        lines: dict[str, int] = {}
        while not isinstance(event := self._next(), yaml.MappingEndEvent):
            key = self._node(event, depth + 1)
            if not isinstance(key, ScalarNode):
                raise self._error("a list or mapping used as a key; allowed: plain names", event)
            if key.text in items:
                raise self._error(f"key {key.text!r} given twice; first in line {lines[key.text]}", event)
            items[key.text], lines[key.text] = self._node(self._next(), depth + 1), key.line
        return MappingNode(items, lines, line)

    def _check(self, event: yaml.Event, depth: int) -> None:
        self._nodes += 1
        if self._nodes > MAX_NODES:
            raise self._error(f"more than {MAX_NODES} values", event)
        if depth > MAX_DEPTH:
            raise self._error(f"nested deeper than {MAX_DEPTH} levels", event)
        if isinstance(event, yaml.AliasEvent):
            raise self._error("an alias; write the value out", event)
        anchor, tag = getattr(event, "anchor", None), getattr(event, "tag", None)
        if anchor is not None:
            raise self._error(f"anchor '&{anchor}'; anchors and aliases are not used in this file", event)
        if tag is not None:
            raise self._error(f"tag '{tag}'; tags are not used in this file", event)

    def _error(self, reason: str, event: yaml.Event) -> MissionError:
        return MissionError(reason, file=self._file, line=_line(event))


def _line(event: yaml.Event) -> int:
    """1-based line an event starts in."""
    return event.start_mark.line + 1 if event.start_mark else 0
