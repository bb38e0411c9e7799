"""What never happens, whatever else does: each rule with its test.

Writing memory that is being flown: test_execute_legs.py. Trusting a return code of 0: test_execute_flights.py.
"""

import dataclasses
import itertools
import struct
from unittest.mock import MagicMock

import pytest

from deploy.clock import VirtualClock
from deploy.errors import CommandRefused, LinkError
from deploy.flight.rescue import Rescue
from deploy.phases import Phase
from deploy.radio.drone import Drone
from deploy.radio.link import Link
from deploy.radio.ping import Pings
from deploy.radio.simulated.crazyflie import SimulatedCrazyflie
from tests.deploy.flight_bench import fly_on, small_plan, stage

SETPOINTS = {3, 7}  # ports: rpyt commander, generic setpoints
HIGH_LEVEL, MEMORY, WRITE = 8, 4, 2
START = struct.Struct("<BBBBBBf")


@pytest.fixture(scope="module")
def heard(tmp_path_factory):
    """Everything that cf1 hears in a flight whose link is lost and opened again; and what came of closing it."""
    packets, drones, refusals = [], {}, []
    receive, build = SimulatedCrazyflie.receive, Drone.__init__
    plan = small_plan()
    with pytest.MonkeyPatch.context() as patch, stage(tmp_path_factory.mktemp("never"), plan) as ready:

        def listening(drone, header, data):
            if drone is ready.swarm.drones["cf1"]:
                packets.append((ready.clock.now(), header >> 4 & 0xF, header & 0x3, bytes(data)))
            return receive(drone, header, data)

        def remembered(drone, name, *args):
            build(drone, name, *args)
            drones[name] = drone

        def observe(status):
            if status.mission_time >= 0.5 and not refusals:
                try:
                    drones["cf1"].close()
                except CommandRefused as error:
                    refusals.append(str(error))
            if status.mission_time >= 1.0 and len(refusals) == 1:
                refusals.append("")
                ready.swarm._clients["cf1"].lose("Too many packets lost")

        patch.setattr(SimulatedCrazyflie, "receive", listening)
        patch.setattr(Drone, "__init__", remembered)
        outcome = fly_on(ready, plan, observer=observe)
        # A packet of the mission's first command says when flying began; the flight closes its links when it is over.
        began = next(t for t, port, _, data in packets if port == HIGH_LEVEL and data[0] == 0x07)
        landed = ready.clock.now()
    return outcome, [packet for packet in packets if began <= packet[0] < landed - 0.02], refusals[0]


def test_a_link_is_never_closed_in_flight(heard):
    outcome, _, refusal = heard
    assert "closing the link in flight would drop the drone" in refusal
    assert outcome.phase is Phase.ABORTED
    assert all(outcome.landed.values())


def test_nobody_in_the_air_gets_a_setpoint_that_outranks_the_commander_though_its_link_is_opened_again(heard):
    outcome, packets, _ = heard
    assert any("back after" in warning for warning in outcome.warnings)
    assert [packet for packet in packets if packet[1] in SETPOINTS] == []


def test_trajectories_start_in_world_coordinates_and_heading(heard):
    _, packets, _ = heard
    starts = [
        START.unpack(data[: START.size]) for _, port, _, data in packets if port == HIGH_LEVEL and data[0] == 0x0D
    ]
    assert len(starts) == 1
    assert starts[0][2:5] == (0, 0, 0)  # not relative, not relative in yaw, not reversed


def test_memory_is_not_written_while_it_is_flown(heard):
    _, packets, _ = heard
    assert [packet for packet in packets if packet[1:3] == (MEMORY, WRITE)] == []


def test_a_link_that_does_not_come_up_again_is_hung_up_without_a_farewell():
    cflib, driver = MagicMock(), MagicMock()
    link = Link(cflib, VirtualClock(), Pings(None))
    cflib.link, link.lost = driver, "gone"  # half a connection
    with pytest.raises(LinkError, match="not connected"):
        link.reopen("radio://0/80", 0.01)
    driver.close.assert_called_once_with()
    cflib.close_link.assert_not_called()
    assert cflib.link is None
    assert (link.lost, link.up) == ("gone", False)


@dataclasses.dataclass
class _Lost:
    fails: int
    lost: str = "gone"
    tries: int = 0

    def reconnect(self, rate):
        self.tries += 1
        if self.tries <= self.fails:
            raise LinkError("still gone")
        self.lost = ""


def test_lost_links_are_tried_again_with_growing_pauses():
    clock, drones = VirtualClock(), {"a": _Lost(3), "b": _Lost(0, lost=""), "c": _Lost(10**6)}
    rescue = Rescue(drones, clock, 10.0)
    back, tried = {}, []
    for k in range(1, 2000):
        clock.sleep_until(0.01 * k)
        before = drones["c"].tries
        back |= rescue.turn(clock.now())
        clock.sleep_until(0.01 * k + 0.001)  # an attempt holds the clock
        tried += [clock.now()] * (drones["c"].tries - before)
    assert set(back) == {"a"}
    assert back["a"] == pytest.approx(0.5 + 1.0 + 2.0 + 4.0, abs=0.1)
    assert drones["b"].tries == 0
    pauses = [b - a for a, b in itertools.pairwise(tried)]
    assert pauses[:4] == pytest.approx([1.0, 2.0, 4.0, 4.0], abs=0.05)
    assert max(pauses) < 4.1
