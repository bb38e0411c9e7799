"""Records of one topic to columns of numbers, without making Python objects of every record.

All records of a topic look the same but for their numbers. That is not assumed: with everything taken away that numbers
are made of, what remains has to be the first record's again and again. Then all numbers are parsed in one go. Records
for which it is not so are parsed one by one, as any JSON is.
"""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from deploy.flightlog.schema import Field, Kind, Topic
from missions.arrays import Array, frozen

AXES = {Kind.VECTOR: "xyz", Kind.QUATERNION: "xyzw"}
TEXTUAL = (Kind.TEXT, Kind.TEXTS, Kind.NUMBERS)
POSE = (Field("position", Kind.VECTOR, "m", "position"), Field("orientation", Kind.QUATERNION, "", "orientation"))
_NUMBER = re.compile(rb"(?<=:)-?\d[-+.\deE]*")
_DIGITS = b"0123456789+-.e"  # what Python's numbers are made of
_OTHERS = bytes(byte if byte in _DIGITS else ord(" ") for byte in range(256))
_NULL = b"1e999"  # infinite: no number of a record is

Columns = tuple[dict[str, Array], dict[str, tuple[object, ...]]]


def columns(topic: Topic, records: bytes, count: int) -> Columns:
    """A topic's fields as arrays, and those that are texts or lists as tuples.

    Args:
        topic: whose records they are.
        records: JSON objects, each followed by a comma.
        count: how many.

    Returns:
        (n,) numbers, (n, 3) vectors, (n, 4) quaternions by name, NaN where null or absent; texts by name.

    Raises:
        ValueError: the bytes are no JSON, or not of this topic.
    """
    posed = topic.schema == "foxglove.PoseInFrame"
    fields = POSE if posed else topic.fields
    if not fields:  # pictures for viewers: nothing is computed from them
        return {}, {}
    if not any(field.kind in TEXTUAL for field in fields):
        found = _alike(records, count, fields, posed)
        if found is not None:
            return found, {}
    # One parse of all records together is several times faster than one each.
    rows: list[dict[str, Any]] = json.loads(b"[" + records[:-1] + b"]")
    if posed:
        rows = [row["pose"] for row in rows]
    numbers = {f.name: _column(f.kind, [row.get(f.name) for row in rows]) for f in fields if f.kind not in TEXTUAL}
    return numbers, {f.name: tuple(row.get(f.name) for row in rows) for f in fields if f.kind in TEXTUAL}


def _alike(records: bytes, count: int, fields: Sequence[Field], posed: bool) -> dict[str, Array] | None:
    """Columns of records that differ in their numbers only; None if they do not."""
    records = records.replace(b"null", _NULL)
    end = records.find(b"},{") + 2 or len(records)
    first = records[:end] if count > 1 else records
    if records.translate(None, _DIGITS) != first.translate(None, _DIGITS) * count:
        return None
    ordinals = itertools.count()
    sample: dict[str, Any] = json.loads(_NUMBER.sub(lambda _: b"%d" % next(ordinals), first[:-1]))
    numbers = records.translate(_OTHERS)
    while b" e" in numbers:  # a letter of a name; that of a number follows a digit
        numbers = numbers.replace(b" e", b"  ")
    table = np.fromstring(numbers, dtype=np.float64, sep=" ")
    width = next(ordinals)
    if len(table) != count * width:
        return None
    table[np.isinf(table)] = np.nan
    table = table.reshape(count, width)
    source = sample["pose"] if posed else sample
    return {field.name: frozen(_picked(table, source.get(field.name), AXES.get(field.kind, ""))) for field in fields}


def _picked(table: Array, where: Any, axes: str) -> Array:  # noqa: ANN401 - a number's ordinal, or some by axis
    """The columns a field's numbers stand in; NaN for what no record has."""
    nothing = np.full(len(table), np.nan)
    if not axes:
        return nothing if where is None else table[:, where]
    return np.stack([table[:, where[axis]] if where and axis in where else nothing for axis in axes], axis=1)


def _column(kind: Kind, values: Iterable[Any]) -> Array:
    if kind in AXES:
        axes = AXES[kind]
        nothing: Mapping[str, None] = dict.fromkeys(axes)
        table = [[(value or nothing).get(axis) for axis in axes] for value in values]
        return frozen(np.array(table, dtype=np.float64).reshape(len(table), len(axes)))
    return frozen(np.array(list(values), dtype=np.float64))
