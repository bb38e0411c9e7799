"""A YAML file as plain values (numbers, text, lists, mappings), with the strictness of mission files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from missions.errors import MissionError
from missions.files import read_text
from missions.scalars import ScalarError, is_null, to_bool, to_float, to_int, to_text
from missions.yamltree import Node, ScalarNode, SequenceNode, parse_yaml
from planner.study.record import StudyError


def read_plain(path: Path) -> Any:  # noqa: ANN401 - plain values
    """Read a YAML file.

    Raises:
        StudyError: unreadable, not YAML, or YAML that mission files may not hold either; names file and line.
    """
    try:
        return _value(parse_yaml(read_text(path), file=str(path)), str(path))
    except MissionError as error:
        raise StudyError(str(error)) from None


def _value(node: Node, file: str) -> Any:  # noqa: ANN401
    if isinstance(node, ScalarNode):
        return _scalar(node, file)
    if isinstance(node, SequenceNode):
        return [_value(item, file) for item in node.items]
    return {key: _value(value, file) for key, value in node.items.items()}


def _scalar(node: ScalarNode, file: str) -> bool | int | float | str | None:
    if is_null(node):
        return None
    for read in (to_bool, to_int, to_float):
        try:
            return read(node)
        except ScalarError:
            continue
    try:
        return to_text(node)
    except ScalarError as error:
        raise StudyError(f"{file}:{node.line}: {error}") from None
