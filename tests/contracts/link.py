"""What a link to a Crazyflie must do, whoever is at the other end.

Plain functions that take a URI; they run on the simulated radio always and on hardware under ``-m hardware``. Nothing
here makes a drone fly. ``advance`` lets time pass at the drone: sleeping on hardware, a virtual clock otherwise.
"""

from __future__ import annotations

import itertools
import queue
from collections.abc import Callable

import pytest
from cflib.crazyflie import Crazyflie
from cflib.crazyflie.log import LogConfig
from cflib.crazyflie.mem import MemoryElement, Poly4D
from cflib.crazyflie.syncCrazyflie import SyncCrazyflie
from cflib.crtp.crtpstack import CRTPPort

Advance = Callable[[float], None]
PATIENCE = 10.0  # [s] of wall time for an answer


def connects_and_becomes_fully_connected(uri: str) -> None:
    with SyncCrazyflie(uri, cf=Crazyflie()) as scf:
        scf.wait_for_params()
        assert scf.cf.is_connected()
        assert "stateEstimate" in scf.cf.log.toc.toc
        assert "stabilizer" in scf.cf.param.toc.toc
        assert scf.cf.platform.get_protocol_version() >= 10


def parameters_come_back_as_written(uri: str) -> None:
    with SyncCrazyflie(uri, cf=Crazyflie()) as scf:
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


def log_blocks_deliver_at_their_period(uri: str, advance: Advance) -> None:
    with SyncCrazyflie(uri, cf=Crazyflie()) as scf:
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


def trajectory_memory_holds_what_was_written(uri: str) -> None:
    with SyncCrazyflie(uri, cf=Crazyflie()) as scf:
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


def flight_commands_are_answered_with_a_return_code(uri: str) -> None:
    """A definition is accepted, an impossible one refused; nothing moves."""
    with SyncCrazyflie(uri, cf=Crazyflie()) as scf:
        answers: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        scf.cf.add_port_callback(CRTPPort.SETPOINT_HL, lambda packet: answers.put(bytes(packet.data)))
        commander = scf.cf.high_level_commander
        commander.define_trajectory(1, 0, 1)
        assert answers.get(timeout=PATIENCE)[3] == 0
        commander.define_trajectory(200, 0, 1)
        assert answers.get(timeout=PATIENCE)[3] == 8


def an_unarmed_drone_refuses_to_take_off(uri: str) -> None:
    """For drones that wait for an arming request."""
    with SyncCrazyflie(uri, cf=Crazyflie()) as scf:
        answers: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        scf.cf.add_port_callback(CRTPPort.SETPOINT_HL, lambda packet: answers.put(bytes(packet.data)))
        scf.cf.high_level_commander.takeoff(0.5, 2.0)
        assert answers.get(timeout=PATIENCE)[3] == 16


def missing_drones_are_an_error(uri: str) -> None:
    with pytest.raises(Exception, match="no drone"):  # cflib wraps what the driver raises in a plain Exception
        SyncCrazyflie(uri, cf=Crazyflie()).open_link()
