"""Decks: what a client sees of them, by packets and through cflib."""

import struct

import pytest
from cflib.crazyflie import Crazyflie
from cflib.crazyflie.mem import MemoryElement
from cflib.crazyflie.mem.deck_memory import SyncDeckMemoryManager
from cflib.crazyflie.syncCrazyflie import SyncCrazyflie

from deploy.radio.simulated.crazyflie import BOOT_TIME
from deploy.radio.simulated.decks import DECKS, EEPROM_SIZE
from deploy.radio.simulated.driver import unregister
from deploy.radio.simulated.platform_defaults import platform_defaults
from deploy.radio.simulated.swarm import SimulatedSwarm
from missions import decks
from missions.airframes import airframe
from tests.deploy.ideal_world import TICK, IdealWorld
from tests.deploy.simulated_bench import Bench


def kinds(bench):
    count = bench.ask(4, 0, b"\x01")[0][1]
    return [bench.ask(4, 0, bytes([2, i]))[0][2] for i in range(count)]


def parameter(bench, name):
    toc = bench.drone._parameters.toc
    answer = bench.ask(2, 1, struct.pack("<H", toc.index[name]))[0]
    return answer[3:]


def test_one_wire_memories_come_last_and_only_on_hardware():
    assert kinds(Bench()) == [0x12, 0x15]
    assert kinds(Bench(hardware=True)) == [0x12, 0x15, 0x19]
    assert kinds(Bench(hardware=True, decks=("bcFlow2", "bcLedRing"))) == [0x12, 0x15, 0x19, 0x10, 0x01, 0x01]


def test_parameters_say_which_decks_are_there():
    bench = Bench(hardware=True, decks=("bcFlow2",))
    assert [parameter(bench, f"deck.{name}") for name in ("bcFlow2", "bcZRanger2", "bcLighthouse4")] == [
        b"\1",
        b"\1",
        b"\0",
    ]


def test_an_eeprom_can_be_rewritten_and_its_end_is_an_error():
    bench = Bench(hardware=True, decks=("bcLighthouse4",))
    assert bench.ask(4, 1, struct.pack("<BIB", 3, 0, 8))[0][6:] == DECKS["bcLighthouse4"].eeprom()[:8]
    assert bench.ask(4, 2, struct.pack("<BI", 3, 0) + b"\x55") == [struct.pack("<BIB", 3, 0, 0)]
    assert bench.ask(4, 1, struct.pack("<BIB", 3, 0, 2))[0][6:] == b"\x55" + DECKS["bcLighthouse4"].eeprom()[1:2]
    assert bench.ask(4, 1, struct.pack("<BIB", 3, EEPROM_SIZE - 1, 2))[0][5:] == b"\x05"
    assert bench.ask(4, 2, struct.pack("<BI", 2, 0) + b"\0") == [struct.pack("<BIB", 2, 0, 5)]  # deck memory


def test_colours_of_a_ring_are_kept_until_a_reboot():
    bench = Bench(hardware=True, decks=("bcLedRing",))
    bench.send(4, 2, struct.pack("<BI", 3, 0) + bytes(range(24)))
    assert bench.ask(4, 1, struct.pack("<BIB", 3, 0, 24))[0][6:] == bytes(range(24))
    bench.send(4, 1, b"\x09" + bytes(4) + b"\x04")  # no such memory: an assertion
    bench.advance(BOOT_TIME + TICK)
    assert bench.ask(4, 1, struct.pack("<BIB", 3, 0, 24))[0][6:] == bytes(24)


def test_unknown_decks_are_refused_with_those_that_are_known():
    with pytest.raises(ValueError, match=r"bcTypo.*bcLighthouse4"):
        Bench(hardware=True, decks=("bcTypo",))


@pytest.mark.parametrize("kind", ["cf21", "cf21_brushless"])
def test_defaults_are_the_airframes(kind):
    bench = Bench(hardware=True, airframe=airframe(kind))
    toc = bench.drone._parameters.toc
    for name, value in platform_defaults(airframe(kind)).items():
        layout = "<H" if name == "posCtlPid.thrustBase" else "<f"
        assert struct.unpack(layout, parameter(bench, name))[0] == pytest.approx(value, rel=1e-6)
        index = struct.pack("<H", toc.index[name])
        assert bench.ask(2, 3, b"\x08" + index)[0][4:] == parameter(bench, name)  # and its default
    bench.advance(TICK)
    assert not bench.body.orders.tuning  # nothing differs from them


def test_cflib_reads_decks_while_it_connects():
    world = IdealWorld([(0.0, 0.0, 0.0)])
    with (
        SimulatedSwarm(["cf"], world, label="decks", decks={"cf": ("bcActiveM", "bcLighthouse4")}) as swarm,
        SyncCrazyflie(swarm.uris()["cf"], cf=Crazyflie()) as scf,
    ):
        found = scf.cf.mem.get_mems(MemoryElement.TYPE_1W)
        assert [(m.valid, m.vid, m.pid, m.elements["Board name"], m.elements["Board revision"]) for m in found] == [
            (True, 0xBC, 0x11, "bcActiveM", "A"),
            (True, 0xBC, 0x10, "bcLighthouse4", "A"),
        ]
        manager = SyncDeckMemoryManager(scf.cf.mem.get_mems(MemoryElement.TYPE_DECK_MEMORY)[0])
        memories = manager.query_decks()
        listed = [(place, m.name, m.is_started, m.supports_write) for place, m in memories.items()]
        assert listed == [(2, "bcLighthouse4", True, False)]
    unregister()


def test_missions_know_the_decks_that_are_simulated_and_by_which_parameter_each_is_found():
    assert {kind.board for kind in decks.DECKS.values()} == set(DECKS)
    for kind in decks.DECKS.values():
        assert kind.parameter.removeprefix("deck.") in DECKS[kind.board].parameters
        alone = Bench(hardware=True, decks=(kind.board,))
        found = {name for name, other in decks.DECKS.items() if parameter(alone, other.parameter) == b"\1"}
        assert found == {name for name, other in decks.DECKS.items() if other is kind} | (
            {"zranger2"} if kind.board == "bcFlow2" else set()  # whose sensor a flow deck has, too
        )
