"""What a link to a Crazyflie must do, whoever is at the other end.

Plain functions that take a URI; :data:`PROMISES` lists those that hold everywhere: on the simulated radio, on the UDP
server and, under ``-m hardware``, on a real Crazyflie. Nothing here makes a drone fly. ``advance`` lets time pass at
the drone: sleeping in real time, a virtual clock otherwise.
"""

from __future__ import annotations

import errno
import itertools
import queue
import struct
import threading
from collections.abc import Callable
from types import TracebackType

import cflib.crtp
import pytest
from cflib.crazyflie import Crazyflie
from cflib.crazyflie.log import LogConfig
from cflib.crazyflie.mem import MemoryElement, Poly4D
from cflib.crazyflie.syncCrazyflie import SyncCrazyflie
from cflib.crtp.crtpstack import CRTPPacket, CRTPPort

Advance = Callable[[float], None]
Promise = Callable[[str, Advance], None]
PROMISES: list[Promise] = []
PATIENCE = 10.0  # [s] of wall time for an answer

PARAM, SETPOINT, MEMORY, LOG, HIGH_LEVEL, SUPERVISOR, PLATFORM, LINK = 2, 3, 4, 5, 8, 9, 13, 15


def promise(check: Promise) -> Promise:
    PROMISES.append(check)
    return check


class Wire:
    """Packets to and from a drone through whichever of cflib's drivers takes the URI, without the rest of cflib."""

    def __init__(self, uri: str) -> None:
        self._errors: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._driver = cflib.crtp.get_link_driver(uri, None, self._errors.put)
        assert self._driver is not None, f"no driver for {uri}"
        self._arrived: queue.SimpleQueue[CRTPPacket] = queue.SimpleQueue()
        self._closing = threading.Event()
        self._tokens = itertools.count()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Wire:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closing.set()
        self._driver.close()
        self._reader.join(PATIENCE)

    def send(self, port: int, channel: int, data: bytes) -> None:
        packet = CRTPPacket()
        packet.set_header(port, channel)
        packet.data = data
        self._driver.send_packet(packet)

    def ask(self, port: int, channel: int, data: bytes) -> bytes:
        """The first answer on the same port and channel."""
        self.send(port, channel, data)
        while True:
            packet = self._arrived.get(timeout=PATIENCE)
            if (packet.port, packet.channel) == (port, channel):
                return bytes(packet.data)

    def collect(self) -> list[tuple[int, int, bytes]]:
        """Everything that is under way, in order: up to the answer to a ping."""
        token = b"collect%d" % next(self._tokens)
        self.send(LINK, 0, token)
        packets = []
        while True:
            packet = self._arrived.get(timeout=PATIENCE)
            packets.append((packet.port, packet.channel, bytes(packet.data)))
            if packets[-1] == (LINK, 0, token):
                return packets[:-1]

    def is_silent(self, port: int, channel: int, data: bytes) -> bool:
        """Whether a request goes unanswered on its port."""
        self.collect()
        self.send(port, channel, data)
        return all(p != port for p, _, _ in self.collect())

    def _read(self) -> None:
        while not self._closing.is_set():
            packet = self._driver.receive_packet(0.2)
            if packet is not None:
                self._arrived.put(packet)


def connected(uri: str) -> SyncCrazyflie:
    return SyncCrazyflie(uri, cf=Crazyflie())


@promise
def connects_and_becomes_fully_connected(uri: str, advance: Advance) -> None:
    console: list[str] = []
    cf = Crazyflie()
    cf.console.receivedChar.add_callback(console.append)
    with SyncCrazyflie(uri, cf=cf) as scf:
        scf.wait_for_params()
        assert scf.cf.is_connected()
        assert "stateEstimate" in scf.cf.log.toc.toc
        assert "stabilizer" in scf.cf.param.toc.toc
        assert scf.cf.platform.get_protocol_version() >= 10
        assert all(text.isascii() for text in console)


@promise
def answers_pings_in_order_and_names_itself(uri: str, advance: Advance) -> None:
    with Wire(uri) as wire:
        for k in range(100):
            token = struct.pack("<Bd", 0, k)
            assert wire.ask(LINK, 0, token) == token
        assert wire.ask(LINK, 0, bytes(range(30))) == bytes(range(30))
        assert wire.ask(LINK, 1, b"\0").startswith(b"Bitcraze Crazyflie")
        assert wire.is_silent(LINK, 2, b"abc")
        assert wire.is_silent(LINK, 3, b"abc")


@promise
def says_what_it_is(uri: str, advance: Advance) -> None:
    with Wire(uri) as wire:
        assert wire.ask(PLATFORM, 1, b"\0")[1] >= 10
        assert wire.ask(PLATFORM, 1, b"\1")[1:].strip(b"\0").isascii()
        assert wire.ask(PLATFORM, 1, b"\2")[1:].strip(b"\0")
        assert wire.is_silent(PLATFORM, 1, b"\3")


@promise
def parameters_come_back_as_written(uri: str, advance: Advance) -> None:
    with connected(uri) as scf:
        scf.wait_for_params()
        for name, value in (("hlCommander.vland", "0.25"), ("hlCommander.groupmask", "5"), ("colAv.vorIters", "77")):
            echoes: queue.SimpleQueue[str] = queue.SimpleQueue()
            before = scf.cf.param.get_value(name)
            group, _, leaf = name.partition(".")
            scf.cf.param.add_update_callback(group=group, name=leaf, cb=lambda _, echo, q=echoes: q.put(echo))
            scf.cf.param.set_value(name, value)
            assert float(echoes.get(timeout=PATIENCE)) == float(value)
            scf.cf.param.set_value(name, before)
            assert float(echoes.get(timeout=PATIENCE)) == float(before)


@promise
def parameters_have_defaults_and_persistent_values(uri: str, advance: Advance) -> None:
    name = "supervisor.landedTimeout"
    with connected(uri) as scf:
        scf.wait_for_params()
        param = scf.cf.param
        answers: queue.SimpleQueue[object] = queue.SimpleQueue()
        param.get_default_value("hlCommander.vland", lambda _, value: answers.put(value))
        assert answers.get(timeout=PATIENCE) == 0.5
        param.persistent_get_state(name, lambda _, state: answers.put(state))
        before = answers.get(timeout=PATIENCE)
        assert before.default_value == 3000
        if not before.is_stored:  # whatever the owner of a real drone has stored stays as it is
            param.persistent_store(name, lambda _, done: answers.put(done))
            assert answers.get(timeout=PATIENCE) is True
            param.persistent_get_state(name, lambda _, state: answers.put(state))
            after = answers.get(timeout=PATIENCE)
            assert after.is_stored
            assert after.stored_value == int(param.get_value(name))
            param.persistent_clear(name, lambda _, done: answers.put(done))
            assert answers.get(timeout=PATIENCE) is True
        with pytest.raises(AttributeError):
            param.persistent_store("hlCommander.vland")
        with pytest.raises(AttributeError):
            param.set_value("firmware.revision0", "1")
        with pytest.raises(KeyError):
            param.set_value("no.such", "1")


@promise
def parameter_requests_that_cannot_be_met_say_so(uri: str, advance: Advance) -> None:
    with Wire(uri) as wire:
        assert wire.ask(PARAM, 1, b"\x0f\x27") == b"\x0f\x27\x02"  # there is no number 9999
        assert wire.ask(PARAM, 2, b"\x0f\x27\x04") == b"\x0f\x27\x02"
        assert wire.ask(PARAM, 0, b"\x02\xff\xff") == b"\x02"
        mask = b"\0hlCommander\0groupmask\0"
        assert wire.ask(PARAM, 3, mask + b"\x08\x03") == mask + b"\0"
        assert wire.ask(PARAM, 3, mask + b"\x08\x00") == mask + b"\0"
        assert wire.ask(PARAM, 3, mask + b"\x06" + struct.pack("<f", 1.0)) == mask + bytes([errno.EINVAL])
        nobody = b"\0hlCommander\0nothing\0"
        assert wire.ask(PARAM, 3, nobody + b"\x08\x00") == nobody + bytes([errno.ENOENT])
        assert wire.is_silent(PARAM, 3, b"\x63\0\0")


@promise
def log_blocks_deliver_at_their_period(uri: str, advance: Advance) -> None:
    with connected(uri) as scf:
        rows: list[tuple[int, dict[str, float]]] = []
        config = LogConfig("contract", 100)
        for name in ("stateEstimate.x", "stateEstimate.y", "stateEstimate.z", "supervisor.info", "motor.m1"):
            config.add_variable(name)
        scf.cf.log.add_config(config)
        config.data_received_cb.add_callback(lambda stamp, data, _: rows.append((stamp, data)))
        started: queue.SimpleQueue[bool] = queue.SimpleQueue()
        config.started_cb.add_callback(lambda _, on: started.put(on))
        config.start()
        assert started.get(timeout=PATIENCE)
        advance(2.05)
        config.stop()
        assert 19 <= len(rows) <= 21
        assert {b - a for (a, _), (b, _) in itertools.pairwise(rows)} <= {99, 100, 101}
        assert set(rows[0][1]) == {v.name for v in config.variables}


@promise
def log_blocks_have_limits_and_error_codes(uri: str, advance: Advance) -> None:
    with Wire(uri) as wire:

        def control(data: bytes) -> int:
            answer = wire.ask(LOG, 1, data)
            assert answer[:2] == data[:2]
            return answer[2]

        count = struct.unpack_from("<H", wire.ask(LOG, 0, b"\x03"), 1)[0]
        assert wire.ask(LOG, 0, b"\x02" + struct.pack("<H", count)) == b"\x02"
        one = b"\x11\0\0"  # whatever comes first, as u8
        assert wire.ask(LOG, 1, b"\x05") == b"\x05\0\0"
        assert control(b"\x06\x01" + one) == 0
        assert control(b"\x06\x01" + one) == errno.EEXIST
        assert control(b"\x06\x02" + 7 * b"\x77\0\0") == errno.E2BIG
        assert control(b"\x06\x02" + one) == errno.EEXIST  # the failed one was allocated
        assert control(b"\x02\x02") == 0
        assert control(b"\x06\x03\x11" + struct.pack("<H", count)) == errno.ENOENT
        assert control(b"\x07\x63" + one) == errno.ENOENT
        assert [control(bytes([command, 0x63, 10])) for command in (2, 3, 4)] == 3 * [errno.ENOENT]
        assert control(b"\x09\x01") == errno.ENOEXEC
        assert wire.ask(LOG, 1, b"\x05") == b"\x05\0\0"
        assert [control(bytes([6, block]) + one) for block in range(17)] == 16 * [0] + [errno.ENOMEM]
        assert wire.ask(LOG, 1, b"\x05") == b"\x05\0\0"
        assert [control(bytes([6, block]) + 8 * one) for block in range(16)] == 16 * [0]
        assert control(b"\x07\x00" + one) == errno.ENOMEM  # variable 129
        assert wire.ask(LOG, 1, b"\x05") == b"\x05\0\0"


@promise
def log_blocks_run_a_hundred_times_a_second(uri: str, advance: Advance) -> None:
    with Wire(uri) as wire:
        assert wire.ask(LOG, 1, b"\x05") == b"\x05\0\0"
        assert wire.ask(LOG, 1, b"\x06\x01\x77\0\0") == b"\x06\x01\0"
        assert wire.ask(LOG, 1, b"\x03\x01\x01") == b"\x03\x01\0"
        advance(1.005)
        wire.send(LOG, 1, b"\x04\x01")
        stamps = [int.from_bytes(data[1:4], "little") for p, c, data in wire.collect() if (p, c) == (LOG, 2)]
        assert 95 <= len(stamps) <= 115  # the answers to stop come a little later
        assert {b - a for a, b in itertools.pairwise(stamps)} <= {9, 10, 11}
        assert wire.ask(LOG, 1, b"\x05") == b"\x05\0\0"


@promise
def trajectory_memory_holds_what_was_written(uri: str, advance: Advance) -> None:
    with connected(uri) as scf:
        memory = scf.cf.mem.get_mems(MemoryElement.TYPE_TRAJ)[0]
        coefficients = [0.25 * k for k in range(8)]
        memory.trajectory = [
            Poly4D(1.5, *(Poly4D.Poly([axis + c for c in coefficients]) for axis in range(4))) for _ in range(31)
        ]
        image = b"".join(bytes(piece.pack()) for piece in memory.trajectory)
        assert memory.write_data_sync()
        answers: queue.SimpleQueue[bytes] = queue.SimpleQueue()

        def arrived(mem: object, address: int, data: bytes) -> None:
            answers.put(bytes(data))

        scf.cf.mem.mem_read_cb.add_callback(arrived)
        assert scf.cf.mem.read(memory, 0, len(image))
        assert answers.get(timeout=PATIENCE) == image


@promise
def memories_are_listed_and_have_bounds(uri: str, advance: Advance) -> None:
    with Wire(uri) as wire:
        count = wire.ask(MEMORY, 0, b"\x01")[1]
        details = [struct.unpack_from("<BBBI", wire.ask(MEMORY, 0, bytes([2, k]))) for k in range(count)]
        assert [number for _, number, _, _ in details] == list(range(count))
        ((number, size),) = [(n, size) for _, n, kind, size in details if kind == MemoryElement.TYPE_TRAJ]
        last, beyond = struct.pack("<BI", number, size - 24), struct.pack("<BI", number, size - 23)
        for content in (bytes(range(24)), bytes(24)):
            assert wire.ask(MEMORY, 2, last + content) == last + b"\0"
            assert wire.ask(MEMORY, 1, last + b"\x18") == last + b"\0" + content
        assert wire.ask(MEMORY, 2, beyond + bytes(24)) == beyond + bytes([errno.EIO])
        assert wire.ask(MEMORY, 1, beyond + b"\x18")[:6] == beyond + bytes([errno.EIO])


@promise
def flight_commands_are_answered_with_a_return_code(uri: str, advance: Advance) -> None:
    """Definitions are accepted, impossible ones refused, undefined trajectories ignored; nothing moves."""
    with Wire(uri) as wire:

        def code(data: bytes) -> int:
            answer = wire.ask(HIGH_LEVEL, 0, data)
            assert answer[:3] == data[:3]
            return answer[3]

        define = struct.Struct("<BBBBIB")
        assert code(define.pack(6, 1, 1, 0, 0, 1)) == 0
        assert code(define.pack(6, 31, 1, 0, 0, 1)) == errno.ENOEXEC
        assert code(b"\x63\0\0") == errno.ENOEXEC
        assert code(struct.pack("<BBff?f", 7, 0x80, 1.0, 0.0, True, 1.0)) == 0  # somebody else's take-off
        assert code(b"\x03\0\0") == 0  # stop


@promise
def the_supervisor_answers(uri: str, advance: Advance) -> None:
    with Wire(uri) as wire:
        answer = wire.ask(SUPERVISOR, 0, b"\x0c")
        assert answer[0] == 0x8C
        bits = int.from_bytes(answer[1:3], "little")
        assert not bits & 0x01F0  # on the ground and well: not flying, tumbled, locked, crashed or steered
        singly = [wire.ask(SUPERVISOR, 0, bytes([question])) for question in range(1, 12)]
        assert singly == [bytes([0x80 | q, bits >> (q - 1) & 1]) for q in range(1, 12)]
        if bits & 2:  # armed: a request to arm is granted and changes nothing
            assert wire.ask(SUPERVISOR, 1, b"\x01\x01") == b"\x81\x01\x01"
        assert wire.ask(SUPERVISOR, 1, b"\x02") == b"\x82\x01\x01"  # nothing to recover from
        assert wire.is_silent(SUPERVISOR, 0, b"\x0d")
        assert wire.is_silent(SUPERVISOR, 1, b"\x09")


@promise
def stopping_setpoints_is_not_answered(uri: str, advance: Advance) -> None:
    with Wire(uri) as wire:
        assert wire.is_silent(7, 1, b"\0" * 5)
        assert wire.is_silent(0, 0, b"nobody reads this")


def an_unarmed_drone_refuses_to_take_off(uri: str) -> None:
    """For drones that wait for an arming request."""
    with connected(uri) as scf:
        answers: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        scf.cf.add_port_callback(CRTPPort.SETPOINT_HL, lambda packet: answers.put(bytes(packet.data)))
        scf.cf.high_level_commander.takeoff(0.5, 2.0)
        assert answers.get(timeout=PATIENCE)[3] == 16


def missing_drones_are_an_error(uri: str) -> None:
    with pytest.raises(Exception, match="no drone"):  # cflib wraps what the driver raises in a plain Exception
        connected(uri).open_link()
