"""Packets as no client should send them: random ones, recorded ones with damage, and well-formed nonsense."""

from __future__ import annotations

import json
import math
import random
import struct
from collections.abc import Iterator
from pathlib import Path

GOLDEN = Path(__file__).parents[1] / "golden"
NASTY = (math.nan, math.inf, -math.inf, 0.0, -0.0, 1e-42, 1e38, -1e38, 1e9, -1.0, 0.5, 3.0)
HIGH_LEVEL = {
    0: "B", 1: "Bff", 2: "Bff", 3: "B", 4: "B?fffff", 5: "B??Bf", 6: "BBBIB", 7: "Bff?f", 8: "Bff?f", 9: "Bf?f?f",
    10: "Bf?f?f", 11: "B??fffff", 12: "B??fffff", 13: "B???Bf",
}  # fmt: skip
SETPOINTS = {0: "", 1: "ffff", 5: "ffff", 6: "9hI3h", 7: "ffff", 8: "ffff", 10: "ffff"}

Packet = tuple[int, bytes]


def recorded() -> list[Packet]:
    """Every request of the recordings: header and data."""
    lines = [json.loads(line)["request"] for line in (GOLDEN / "protocol_cases.jsonl").read_text().splitlines()]
    lines += [line[3:] for line in (GOLDEN / "handshake.txt").read_text().splitlines() if line.startswith("tx ")]
    packets = []
    for line in dict.fromkeys(lines):
        place, _, payload = line.partition(" ")
        port, _, channel = place.partition(":")
        packets.append((int(port) << 4 | int(channel), bytes.fromhex(payload)))
    return packets


class Storm:
    """An endless, repeatable stream of packets.

    Args:
        seed: of the stream.
        memories: number of memories that exist; more are asked for only now and then, because that is a reboot.
    """

    def __init__(self, seed: int, memories: int = 2) -> None:
        self._random = random.Random(seed)
        self._memories = memories
        self._recorded = recorded()
        self._kinds = [self._anything] + 2 * [self._damaged] + 3 * [self._nonsense]

    def packets(self, count: int) -> Iterator[Packet]:
        """The next ones."""
        for _ in range(count):
            header, data = self._random.choice(self._kinds)()
            if header >> 4 == 4 and header & 3 and data and self._random.random() < 0.95:
                data = bytes([data[0] % self._memories]) + data[1:]
            yield header, data[:30]

    def _anything(self) -> Packet:
        return self._random.randrange(256), self._random.randbytes(self._random.randrange(31))

    def _damaged(self) -> Packet:
        r = self._random
        header, data = r.choice(self._recorded)
        damaged = bytearray(data)
        for _ in range(r.randrange(4)):
            if damaged:
                damaged[r.randrange(len(damaged))] = r.randrange(256)
        cut = r.random()
        if cut < 0.2:
            damaged = damaged[: r.randrange(len(damaged) + 1)]
        elif cut < 0.3:
            damaged += r.randbytes(r.randrange(6))
        return header ^ (r.randrange(4) if r.random() < 0.05 else 0), bytes(damaged)

    def _nonsense(self) -> Packet:
        """The right layout, the wrong numbers."""
        r = self._random
        kind = r.randrange(8)
        if kind < 3:
            command = r.choice(list(HIGH_LEVEL))
            return 0x80, bytes([command]) + self._fill(HIGH_LEVEL[command])
        if kind == 3:
            command = r.choice(list(SETPOINTS))
            return 0x70, bytes([command]) + self._fill(SETPOINTS[command])
        if kind == 4:
            return r.choice([(0x30, self._fill("fffH")), (0x60, self._fill("fff")), (0x61, b"\x08" + self._fill("7f"))])
        if kind == 5:
            return 0x22, struct.pack("<H", r.randrange(330)) + self._fill(r.choice("fBHIq"))
        if kind == 6:
            return 0x42, struct.pack("<BI", 0, r.randrange(4096)) + self._fill("ffffff")[: r.randrange(26)]
        return 0x51, bytes([r.choice([2, 3, 4, 6, 6, 6, 7, 8]), r.randrange(18)]) + self._fill(r.randrange(9) * "BH")

    def _fill(self, layout: str) -> bytes:
        """Values for a struct layout: floats that hurt, integers from end to end."""
        r = self._random
        out = b""
        for code in struct_codes(layout):
            if code == "f":
                value = struct.pack("<f", r.choice(NASTY) if r.random() < 0.6 else r.uniform(-5.0, 5.0))
            elif code == "?":
                value = bytes([r.randrange(2)])
            elif code == "B":
                value = bytes([r.choice([0, 0, 0, 1, 1, 2, 255, r.randrange(256)])])
            else:
                value = r.randbytes(struct.calcsize("<" + code))
            out += value
        return out


def struct_codes(layout: str) -> Iterator[str]:
    """Single codes of a layout: ``9hI`` is nine times h, then I."""
    count = ""
    for code in layout:
        if code.isdigit():
            count += code
        else:
            yield from code * int(count or 1)
            count = ""
