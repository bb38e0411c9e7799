"""Tables of contents: what can be logged and what can be set, in the firmware's own order.

The recorded tables (``toc_log.json``, ``toc_param.json``) are those of crazyflie-firmware at the commit they name: same
indices, types, defaults and checksums, so a recorded handshake replays byte for byte. That build ran on a desktop and
lacks a few groups every Crazyflie has (battery, radio, decks); ``hardware=True`` appends them, which changes the
checksum but no index.
"""

from __future__ import annotations

import json
import struct
import zlib
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files

EXTENDED, CORE, READ_ONLY = 0x10, 0x20, 0x40  # bits of a parameter's type byte (firmware param.h)

LOG_FORMATS = {1: "B", 2: "H", 3: "I", 4: "b", 5: "h", 6: "i", 7: "f", 8: "e"}
PARAM_FORMATS = {
    0x8: "B",
    0x9: "H",
    0xA: "I",
    0xB: "Q",
    0x0: "b",
    0x1: "h",
    0x2: "i",
    0x3: "q",
    0x5: "e",
    0x6: "f",
    0x7: "d",
}
LOG_STRUCTS = {code: struct.Struct("<" + form) for code, form in LOG_FORMATS.items()}
PARAM_STRUCTS = {code: struct.Struct("<" + form) for code, form in PARAM_FORMATS.items()}

_INFO_V2, _ITEM_V2 = 0x03, 0x02
_ITEM_REQUEST = struct.Struct("<BH")


@dataclass(frozen=True, slots=True)
class TocEntry:
    """One variable or parameter.

    Attributes:
        group, name: as in ``group.name``.
        type: the type byte as it travels.
        default: little-endian default value of a parameter, empty for a log variable.
    """

    group: str
    name: str
    type: int
    default: bytes = b""

    @property
    def full_name(self) -> str:
        """``group.name``."""
        return f"{self.group}.{self.name}"


class Toc:
    """A table of contents and its answers on a TOC channel (firmware log.c, param_logic.c; version 2 only).

    Args:
        entries: in index order.
        crc: checksum under which clients cache the table.
        tail: bytes that follow the checksum in the info answer (log: most blocks, most variables).
    """

    def __init__(self, entries: tuple[TocEntry, ...], crc: int, tail: bytes = b"") -> None:
        self.entries = entries
        self.crc = crc
        self.index = {entry.full_name: i for i, entry in enumerate(entries)}
        self._info = struct.pack("<BHI", _INFO_V2, len(entries), crc) + tail
        self._items = [
            struct.pack("<BHB", _ITEM_V2, i, entry.type) + f"{entry.group}\0{entry.name}\0".encode()
            for i, entry in enumerate(entries)
        ]

    def answer(self, request: bytes) -> bytes | None:
        """Answer to a TOC request; None for commands the firmware ignores (among them version 1)."""
        if not request:
            return None
        if request[0] == _INFO_V2:
            return self._info
        if request[0] != _ITEM_V2 or len(request) < _ITEM_REQUEST.size:
            return None
        index = _ITEM_REQUEST.unpack_from(request)[1]
        return self._items[index] if index < len(self._items) else bytes([_ITEM_V2])


def _read(name: str) -> dict[str, object]:
    content = json.loads(files(__package__).joinpath(name).read_text(encoding="utf-8"))
    if not isinstance(content, dict):
        raise TypeError(f"{name}: got {type(content).__name__}, needs an object")
    return content


def _entries(rows: object) -> tuple[TocEntry, ...]:
    if not isinstance(rows, list):
        raise TypeError(f"a table of contents is a list of rows; got {type(rows).__name__}")
    return tuple(TocEntry(row[0], row[1], row[2], bytes.fromhex(row[3]) if len(row) > 3 else b"") for row in rows)


def _load(kind: str, tail: bytes, hardware: bool) -> Toc:
    recorded = _read(f"toc_{kind}.json")
    entries, crc = _entries(recorded["items"]), int(str(recorded["crc"]), 16)
    if hardware:
        entries += _entries(_read("toc_hardware.json")[kind])
        crc = zlib.crc32("\n".join(f"{entry.full_name}:{entry.type}" for entry in entries).encode())
    return Toc(entries, crc, tail)


@cache
def log_toc(hardware: bool = True) -> Toc:
    """Table of the log variables (at most 16 blocks and 128 variables at a time)."""
    return _load("log", bytes([16, 128]), hardware)


@cache
def param_toc(hardware: bool = True, values: tuple[tuple[str, float], ...] = ()) -> Toc:
    """Table of the parameters; ``values`` by full name replace defaults, which leaves the checksum as it is."""
    toc = _load("param", b"", hardware)
    entries = list(toc.entries)
    for name, value in values:
        if name not in toc.index:  # a build without that parameter
            continue
        entry = entries[toc.index[name]]
        layout = PARAM_STRUCTS[entry.type & 0x0F]
        whole = layout.format[-1] not in "efd"
        entries[toc.index[name]] = replace(entry, default=layout.pack(round(value) if whole else value))
    return Toc(tuple(entries), toc.crc)
