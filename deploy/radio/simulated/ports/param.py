"""Port 2, parameters: table of contents, read, write, the rest (firmware param_logic.c, param_task.c)."""

from __future__ import annotations

import errno
import struct
from collections.abc import Callable, Mapping

from deploy.radio.simulated.parameters import Parameters
from deploy.radio.simulated.ports import Send

PORT = 2
_TOC, _READ, _WRITE, _MISC = 0, 1, 2, 3
_ID = struct.Struct("<H")
_PERSISTENT = 1
_VALUE_UPDATED = 0x01


class ParamPort:
    """Answers as protocol 12 does, older commands included.

    Args:
        send: where answers go.
        parameters: the values.
    """

    def __init__(self, send: Send, parameters: Parameters) -> None:
        self._send, self._parameters = send, parameters
        self._misc: Mapping[int, Callable[[int, int], bytes]] = {
            0x02: lambda c, i: self._when(self._parameters.is_persistent(i), c, i, bytes([_PERSISTENT])),
            0x03: self._store,
            0x04: self._state,
            0x05: self._clear,
            0x06: lambda c, i: self._when(self._parameters.is_writable(i), c, i, self._parameters.default(i)),
            0x07: lambda c, i: self._when(self._parameters.is_persistent(i), c, i, bytes([0, _PERSISTENT])),
            0x08: lambda c, i: self._when(self._parameters.is_writable(i), c, i, b"\0" + self._parameters.default(i)),
        }

    def receive(self, channel: int, data: bytes) -> None:
        """Handle a request; writes to read-only parameters are not answered at all."""
        if channel == _TOC:
            answer = self._parameters.toc.answer(data)
            if answer is not None:
                self._send(PORT, _TOC, answer)
        elif channel == _READ and len(data) >= _ID.size:
            index = _ID.unpack_from(data)[0]
            value = b"\0" + self._parameters.raw(index) if self._exists(index) else bytes([errno.ENOENT])
            self._send(PORT, _READ, data[:2] + value)
        elif channel == _WRITE and len(data) >= _ID.size:
            self._write(data)
        elif channel == _MISC and data:
            self._receive_misc(data)

    def notify(self, name: str) -> None:
        """Tell the client that the firmware itself changed a value."""
        index = self._parameters.toc.index[name]
        self._send(PORT, _MISC, struct.pack("<BH", _VALUE_UPDATED, index) + self._parameters.raw(index))

    def _exists(self, index: int) -> bool:
        return index < len(self._parameters)

    def _write(self, data: bytes) -> None:
        index = _ID.unpack_from(data)[0]
        if not self._exists(index):
            self._send(PORT, _WRITE, data[:2] + bytes([errno.ENOENT]))
        elif self._parameters.is_writable(index) and self._parameters.write(index, data[2:]):
            self._send(PORT, _WRITE, data)

    def _receive_misc(self, data: bytes) -> None:
        command = data[0]
        if command == 0x00:
            self._set_by_name(data)
        elif command in self._misc and len(data) > _ID.size:
            index = _ID.unpack_from(data, 1)[0]
            missing = data[:3] + bytes([errno.ENOENT])
            self._send(PORT, _MISC, self._misc[command](command, index) if self._exists(index) else missing)

    @staticmethod
    def _when(possible: bool, command: int, index: int, answer: bytes) -> bytes:
        return struct.pack("<BH", command, index) + (answer if possible else bytes([errno.ENOENT]))

    def _store(self, command: int, index: int) -> bytes:
        persistent = self._parameters.is_persistent(index)
        if persistent:
            self._parameters.store(index)
        return self._when(persistent, command, index, b"\0")

    def _clear(self, command: int, index: int) -> bytes:
        persistent = self._parameters.is_persistent(index)
        if persistent:
            self._parameters.clear(index)
        return self._when(persistent, command, index, b"\0")

    def _state(self, command: int, index: int) -> bytes:
        stored = self._parameters.stored(index)
        flag = b"\0" if stored is None else b"\x01"
        answer = flag + self._parameters.default(index) + (stored or b"")
        return self._when(self._parameters.is_persistent(index), command, index, answer)

    def _set_by_name(self, data: bytes) -> None:
        parts = data[1:].split(b"\0", 2)
        if len(parts) < 3 or not parts[2]:
            return
        group, name, rest = parts
        index = self._parameters.toc.index.get(f"{group.decode('latin-1')}.{name.decode('latin-1')}")
        if index is None:
            error = errno.ENOENT
        elif self._parameters.toc.entries[index].type & 0x0F != rest[0] & 0x0F:
            error = errno.EINVAL
        elif not self._parameters.is_writable(index):
            error = errno.EACCES
        else:
            error = 0 if self._parameters.write(index, rest[1:]) else errno.EINVAL
        self._send(PORT, _MISC, b"\0" + group + b"\0" + name + b"\0" + bytes([error]))
