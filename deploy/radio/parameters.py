"""On-board parameters: written, acknowledged, read back (param_logic.c)."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from deploy.errors import CommandRefused
from deploy.radio.requests import Request, Requests

PORT = 2
_TYPES = {
    0x08: "<B",
    0x09: "<H",
    0x0A: "<I",
    0x0B: "<Q",
    0x00: "<b",
    0x01: "<h",
    0x02: "<i",
    0x03: "<q",
    0x05: "<e",
    0x06: "<f",
    0x07: "<d",
}


@dataclass(frozen=True)
class Parameter:
    """An entry of the drone's parameter table: full name, number, struct format of its type, whether it is constant."""

    name: str
    identifier: int
    form: str
    read_only: bool

    def encode(self, value: float) -> bytes:
        """The value in the parameter's own type.

        Raises:
            CommandRefused: it does not fit.
        """
        try:
            number = value if self.form in ("<e", "<f", "<d") else int(value)
            if number != value:
                raise CommandRefused(f"parameter {self.name}: got {value}; it holds whole numbers only")
            return struct.pack(self.form, number)
        except (struct.error, OverflowError, ValueError) as error:
            raise CommandRefused(f"parameter {self.name}: {value} does not fit its type ({error})") from error

    def decode(self, data: bytes) -> float:
        """The value in ``data``."""
        if len(data) < struct.calcsize(self.form):
            raise CommandRefused(f"parameter {self.name}: got {len(data)} bytes for its value")
        value: float = struct.unpack_from(self.form, data)[0]
        return value


def read(requests: Requests, parameter: Parameter) -> float:
    """Ask the drone itself, not a cache.

    Raises:
        CommandRefused: it does not know the parameter. LinkError: no answer.
    """
    number = struct.pack("<H", parameter.identifier)
    answer = requests.ask(Request(PORT, 1, number, number, f"read parameter {parameter.name}"))
    if len(answer) < 3 or answer[2] != 0:
        raise CommandRefused(f"parameter {parameter.name}: the drone does not know it")
    return parameter.decode(answer[3:])


def writing(parameter: Parameter, value: float) -> Request:
    """What writes ``value``, without reading it back.

    Raises:
        CommandRefused: read-only, or it does not fit.
    """
    if parameter.read_only:
        raise CommandRefused(f"parameter {parameter.name} is read-only")
    number = struct.pack("<H", parameter.identifier)
    return Request(PORT, 2, number + parameter.encode(value), number, f"write parameter {parameter.name}")


def write(requests: Requests, parameter: Parameter, value: float, *, compare: bool = True) -> float:
    """Write, wait for the acknowledgement, read back; returns what the drone holds now, in the parameter's type.

    Args:
        requests: of the drone.
        parameter: what to write.
        value: what it shall hold.
        compare: refuse if it holds something else; False for parameters the firmware changes itself.

    Raises:
        CommandRefused: read-only, does not fit, or the drone holds something else afterwards. LinkError: no answer.
    """
    requests.ask(writing(parameter, value))
    held = read(requests, parameter)
    if compare and struct.pack(parameter.form, held) != parameter.encode(value):
        raise CommandRefused(f"parameter {parameter.name}: wrote {value:g}, the drone holds {held:g}")
    return held
