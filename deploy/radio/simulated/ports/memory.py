"""Port 4, memory: enumeration, reading and writing (firmware mem.c)."""

from __future__ import annotations

import errno
import struct
from collections.abc import Sequence

from deploy.radio.simulated.ports import FirmwareAssertion, Send
from deploy.radio.simulated.ports.memories import Memory

PORT = 4
_INFO, _READ, _WRITE = 0, 1, 2
_COUNT, _DETAILS = 1, 2
_HEAD = struct.Struct("<BI")
_LONGEST_READ = 24


class MemoryPort:
    """Reads and writes the memories of one drone by their number.

    Args:
        send: where answers go.
        memories: in their order.
    """

    def __init__(self, send: Send, memories: Sequence[Memory]) -> None:
        self._send, self._memories = send, memories

    def receive(self, channel: int, data: bytes) -> None:
        """Answer; raises FirmwareAssertion for what the firmware asserts against."""
        if channel == _INFO:
            self._info(data)
        elif channel == _READ:
            self._read(data)
        elif channel == _WRITE:
            self._write(data)

    def _info(self, data: bytes) -> None:
        if data[:1] == bytes([_COUNT]):
            self._send(PORT, _INFO, bytes([_COUNT, len(self._memories)]))
        elif data[:1] == bytes([_DETAILS]):
            index = data[1] if len(data) > 1 else 0
            memory = self._existing(index)
            self._send(PORT, _INFO, struct.pack("<BBBI8s", _DETAILS, index, memory.kind, memory.size, memory.serial))

    def _read(self, data: bytes) -> None:
        index, address = _HEAD.unpack_from(data.ljust(_HEAD.size, b"\0"))
        length = data[_HEAD.size] if len(data) > _HEAD.size else 0
        memory = self._existing(index)
        if length > _LONGEST_READ:
            raise FirmwareAssertion(f"read of {length} bytes: the answer would be longer than a packet")
        head = _HEAD.pack(index, address)
        if _is_inside(memory, address, length):
            self._send(PORT, _READ, head + b"\0" + memory.read(address, length))
        else:
            self._send(PORT, _READ, head + bytes([errno.EIO]))

    def _write(self, data: bytes) -> None:
        index, address = _HEAD.unpack_from(data.ljust(_HEAD.size, b"\0"))
        payload = data[_HEAD.size :]
        memory = self._existing(index)
        kept = _is_inside(memory, address, len(payload)) and memory.write(address, payload)
        self._send(PORT, _WRITE, _HEAD.pack(index, address) + bytes([0 if kept else errno.EIO]))

    def _existing(self, index: int) -> Memory:
        if index >= len(self._memories):
            raise FirmwareAssertion(f"memory {index} does not exist; there are {len(self._memories)}")
        return self._memories[index]


def _is_inside(memory: Memory, address: int, length: int) -> bool:
    if address + length > 0xFFFFFFFF:
        raise FirmwareAssertion("address + length wraps around: the firmware's bounds test passes and it faults")
    return address + length <= memory.size
