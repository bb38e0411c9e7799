"""Fields of mission records: every one carries its meaning, unit and bounds.

The loader validates with them, the JSON Schema is generated from them, and error messages quote them.
"""

from __future__ import annotations

import dataclasses
from types import MappingProxyType
from typing import Any

Vector = tuple[float, ...]

NAME = "[A-Za-z0-9_][A-Za-z0-9_-]{0,63}"  # safe in file names, topics and on a command line


def field(
    doc: str,
    *,
    unit: str = "",
    default: Any = dataclasses.MISSING,  # noqa: ANN401 - a field's default has the field's type
    at_least: float | None = None,
    above: float | None = None,
    at_most: float | None = None,
    below: float | None = None,
    items: tuple[int, int] | None = None,
    pattern: str = "",
) -> Any:  # noqa: ANN401 - like dataclasses.field
    """A record field with its meaning, unit and what is allowed in it.

    Bounds apply to every number in the field, ``items`` is the least and largest length of a list, ``pattern`` a
    regular expression for the whole of a text.
    """
    meta = {
        "doc": doc,
        "unit": unit,
        "at_least": at_least,
        "above": above,
        "at_most": at_most,
        "below": below,
        "items": items,
        "pattern": pattern,
    }
    return dataclasses.field(default=default, metadata=MappingProxyType(meta))
