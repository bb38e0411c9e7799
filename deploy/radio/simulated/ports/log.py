"""Port 5, logging: table of contents, blocks, data (firmware log.c)."""

from __future__ import annotations

import errno
import math
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from deploy.radio.simulated.ports import Send
from deploy.radio.simulated.toc import LOG_FORMATS, LOG_STRUCTS, Toc

PORT = 5
_TOC, _CONTROL, _DATA = 0, 1, 2
_MOST_BYTES, _MOST_BLOCKS, _MOST_VARIABLES = 26, 16, 128
_OPERATION = struct.Struct("<BH")
_HEAD = struct.Struct("<I")  # number, then 24 bits of ms
_FLOAT, _HALF = 7, 8
_EMPTY = struct.Struct("")
_FLOATS = (_FLOAT, _HALF)

Getter = Callable[[], float]


@dataclass
class _Block:
    """A log block; ``due`` and ``period`` in ms since boot, period 0 when it does not run."""

    operations: list[tuple[int, Getter]] = field(default_factory=list)
    layout: struct.Struct = _EMPTY
    size: int = 0
    period: int = 0
    due: int = 0


class LogPort:
    """Log blocks of one client.

    Args:
        send: where answers and data go.
        toc: the variables.
        getters: how to read them, by full name; the others read 0.
        now: ms since boot.
    """

    def __init__(self, send: Send, toc: Toc, getters: Mapping[str, Getter], now: Callable[[], int]) -> None:
        self._send, self._toc, self._getters, self._now = send, toc, getters, now
        self._blocks: dict[int, _Block] = {}
        self._running: dict[int, _Block] = {}
        self._next_due = 0  # [ms] nothing is due before
        self._control: Mapping[int, Callable[[int, bytes], int]] = {
            0x02: self._delete,
            0x03: lambda block, args: self._start(block, (args[0] if args else 0) * 10),
            0x04: self._stop,
            0x06: self._create,
            0x07: self._append,
            0x08: lambda block, args: self._start(block, int.from_bytes(args[:2], "little")),
        }

    def receive(self, channel: int, data: bytes) -> None:
        """Handle a request. A one-shot block (period 0) sends its data right behind the answer."""
        if channel == _TOC:
            answer = self._toc.answer(data)
            if answer is not None:
                self._send(PORT, _TOC, answer)
        elif channel == _CONTROL and data:
            command, block = data[0], data[1] if len(data) > 1 else 0
            if command == 0x05:
                self.reset()
                self._send(PORT, _CONTROL, bytes([command, block, 0]))
                return
            action = self._control.get(command)
            error = action(block, data[2:]) if action else errno.ENOEXEC
            self._send(PORT, _CONTROL, bytes([command, block, error]))
            if command in (0x03, 0x08) and not error and block not in self._running:
                self._emit(block, self._blocks[block], self._now())

    @property
    def due(self) -> float:
        """When :meth:`run` has something to send [ms since boot]; infinite if no block runs."""
        return self._next_due if self._running else math.inf

    def reset(self) -> None:
        """Forget all blocks."""
        self._blocks.clear()
        self._running.clear()

    def run(self) -> None:
        """Send the blocks that are due."""
        if not self._running:
            return
        now = self._now()
        if now < self._next_due:
            return
        for number, block in self._running.items():
            if now >= block.due:
                self._emit(number, block, now)
                block.due += block.period * (1 + (now - block.due) // block.period)
        self._next_due = min(block.due for block in self._running.values())

    def _create(self, number: int, args: bytes) -> int:
        if number in self._blocks:
            return errno.EEXIST
        if len(self._blocks) >= _MOST_BLOCKS:
            return errno.ENOMEM
        self._blocks[number] = _Block()
        return self._append(number, args)

    def _append(self, number: int, args: bytes) -> int:
        """Add variables; those before a refused one stay. A surplus byte at the end is ignored."""
        block = self._blocks.get(number)
        if block is None:
            return errno.ENOENT
        used = sum(len(other.operations) for other in self._blocks.values())
        for offset in range(0, len(args) - _OPERATION.size + 1, _OPERATION.size):
            kind, index = _OPERATION.unpack_from(args, offset)
            kind &= 0x0F
            size = LOG_STRUCTS[kind].size if kind in LOG_STRUCTS else 0
            if block.size + size > _MOST_BYTES:
                return errno.E2BIG
            if used >= _MOST_VARIABLES:
                return errno.ENOMEM
            if index >= len(self._toc.entries):
                return errno.ENOENT
            block.operations.append((kind, self._getters.get(self._toc.entries[index].full_name, _zero)))
            block.size += size
            block.layout = struct.Struct("<" + "".join(LOG_FORMATS.get(kind, "") for kind, _ in block.operations))
            used += 1
        return 0

    def _delete(self, number: int, _: bytes) -> int:
        self._running.pop(number, None)
        return 0 if self._blocks.pop(number, None) is not None else errno.ENOENT

    def _start(self, number: int, period: int) -> int:
        block = self._blocks.get(number)
        if block is None:
            return errno.ENOENT
        if period == 0:
            self._running.pop(number, None)
        else:
            block.period, block.due = period, self._now() + period
            self._next_due = min(self._next_due, block.due)
            self._running[number] = block
        return 0

    def _stop(self, number: int, _: bytes) -> int:
        self._running.pop(number, None)
        return 0 if number in self._blocks else errno.ENOENT

    def _emit(self, number: int, block: _Block, now: int) -> None:
        head = _HEAD.pack((now & 0xFFFFFF) << 8 | number)
        self._send(PORT, _DATA, head + _pack_all(block))


def _zero() -> float:
    return 0.0


def _pack_all(block: _Block) -> bytes:
    """All values of a block; at once if none has to be cast as C would."""
    try:
        return block.layout.pack(*[g() if kind in _FLOATS else int(g()) for kind, g in block.operations])
    except (struct.error, OverflowError, ValueError):
        return b"".join(encode(kind, getter()) for kind, getter in block.operations)


def encode(kind: int, value: float) -> bytes:
    """One value as it travels: integers truncated and wrapped like C casts, unknown types as nothing."""
    if kind == _FLOAT:
        return _pack(LOG_STRUCTS[_FLOAT], value)
    if kind == _HALF:
        return _pack(LOG_STRUCTS[_HALF], value)
    if kind not in LOG_STRUCTS:
        return b""
    size = LOG_STRUCTS[kind].size
    whole = int(value) if math.isfinite(value) else 0
    return (whole & (1 << 8 * size) - 1).to_bytes(size, "little")


def _pack(layout: struct.Struct, value: float) -> bytes:
    try:
        return layout.pack(value)
    except OverflowError:  # beyond the format's range
        return layout.pack(math.copysign(math.inf, value))
