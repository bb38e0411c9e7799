"""Reading and writing the drone's memories, chunk by chunk (crtp_mem.c), as conversations.

Every chunk is acknowledged; cflib's own memory client waits for ever for a lost one. A conversation only says what to
ask next and what it makes of the answer: on the ground a worker thread carries it on, in flight the flight loop does,
a packet at a time.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from deploy.errors import UploadError
from deploy.radio.requests import Conversation, Request

PORT = 4
CHUNK = 24  # bytes; a longer read makes the firmware assert
TRAJECTORY = 0x12  # memory type


@dataclass(frozen=True)
class MemoryInfo:
    """One of the drone's memories: its number, type and size [bytes]."""

    identifier: int
    kind: int
    size: int


def writing(memory: MemoryInfo, address: int, data: bytes) -> Conversation[None]:
    """Write ``data`` at ``address``.

    Raises:
        UploadError: the drone refused a chunk.
    """
    for start in range(0, len(data), CHUNK):
        where = address + start
        head = struct.pack("<BI", memory.identifier, where)
        what = f"write to memory {memory.identifier} at {where}"
        answer = yield Request(PORT, 2, head + data[start : start + CHUNK], head, what)
        _check(answer, what)


def reading(memory: MemoryInfo, address: int, length: int) -> Conversation[bytes]:
    """Read ``length`` bytes at ``address``.

    Raises:
        UploadError: the drone refused, or answered with another length.
    """
    data = bytearray()
    while len(data) < length:
        where, count = address + len(data), min(CHUNK, length - len(data))
        head = struct.pack("<BI", memory.identifier, where)
        what = f"read of memory {memory.identifier} at {where}"
        answer = yield Request(PORT, 1, head + bytes([count]), head, what)
        _check(answer, what)
        if len(answer) != len(head) + 1 + count:
            raise UploadError(f"{what}: asked for {count} bytes, got {len(answer) - len(head) - 1}")
        data += answer[len(head) + 1 :]
    return bytes(data)


def _check(answer: bytes, what: str) -> None:
    status = answer[5] if len(answer) > 5 else 0xFF
    if status != 0:
        raise UploadError(f"{what}: the drone answered with error {status}; 5 means outside the memory")
