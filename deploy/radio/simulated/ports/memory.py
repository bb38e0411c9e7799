"""Port 4, memory: enumeration, reading and writing (firmware mem.c)."""

from __future__ import annotations

import errno
import struct
from collections.abc import Callable

from deploy.radio.simulated.high_level.trajectory import TrajectoryMemory
from deploy.radio.simulated.ports import FirmwareAssertion, Send

PORT = 4
_INFO, _READ, _WRITE = 0, 1, 2
_COUNT, _DETAILS = 1, 2
_TRAJECTORY_TYPE, _TESTER_TYPE = 0x12, 0x15
_TESTER_SIZE = 4096
_HEAD = struct.Struct("<BI")
_LONGEST_READ = 24


class MemoryPort:
    """Memory 0 holds trajectories, memory 1 is the firmware's tester (reads give the address, writes are compared).

    Args:
        send: where answers go.
        trajectories: trajectory memory.
        tester_error: called once for every byte written to the tester that differs from its address.
    """

    def __init__(self, send: Send, trajectories: TrajectoryMemory, tester_error: Callable[[], None]) -> None:
        self._send, self._trajectories, self._tester_error = send, trajectories, tester_error
        self._details = [(_TRAJECTORY_TYPE, trajectories.size), (_TESTER_TYPE, _TESTER_SIZE)]

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
            self._send(PORT, _INFO, bytes([_COUNT, len(self._details)]))
        elif data[:1] == bytes([_DETAILS]):
            index = self._existing(data[1] if len(data) > 1 else 0)
            kind, size = self._details[index]
            self._send(PORT, _INFO, struct.pack("<BBBI8x", _DETAILS, index, kind, size))

    def _read(self, data: bytes) -> None:
        index, address = _HEAD.unpack_from(data.ljust(_HEAD.size, b"\0"))
        length = data[_HEAD.size] if len(data) > _HEAD.size else 0
        self._existing(index)
        if length > _LONGEST_READ:
            raise FirmwareAssertion(f"read of {length} bytes: the answer would be longer than a packet")
        head = _HEAD.pack(index, address)
        if not self._is_inside(index, address, length):
            self._send(PORT, _READ, head + bytes([errno.EIO]))
        elif index == 0:
            self._send(PORT, _READ, head + b"\0" + self._trajectories.read(address, length))
        else:
            self._send(PORT, _READ, head + b"\0" + bytes((address + i) & 0xFF for i in range(length)))

    def _write(self, data: bytes) -> None:
        index, address = _HEAD.unpack_from(data.ljust(_HEAD.size, b"\0"))
        payload = data[_HEAD.size :]
        self._existing(index)
        inside = self._is_inside(index, address, len(payload))
        if inside and index == 0:
            self._trajectories.write(address, payload)
        elif inside:
            for i, byte in enumerate(payload):
                if byte != (address + i) & 0xFF:
                    self._tester_error()
        self._send(PORT, _WRITE, _HEAD.pack(index, address) + bytes([0 if inside else errno.EIO]))

    def _existing(self, index: int) -> int:
        if index >= len(self._details):
            raise FirmwareAssertion(f"memory {index} does not exist; there are {len(self._details)}")
        return index

    def _is_inside(self, index: int, address: int, length: int) -> bool:
        if address + length > 0xFFFFFFFF:
            raise FirmwareAssertion("address + length wraps around: the firmware's bounds test passes and it faults")
        return bool(address + length <= self._details[index][1])
