"""Simulated drones are asked only when something is due, and nobody can tell."""

import struct

import numpy as np
import pytest

from deploy.radio.simulated.crazyflie import SimulatedCrazyflie
from deploy.radio.simulated.interface import PERIOD, Setpoint, SetpointMode, Telemetry
from deploy.radio.simulated.physics.setpoints import MODES, SetpointTable

HIGH_LEVEL, LINK, LOCALIZATION = 0x80, 0xF0, 0x60
TAKE_OFF = struct.pack("<BBff?f", 7, 0, 1.0, 0.3, False, 1.5)
GO_TO = struct.pack("<BB??fffff", 12, 0, False, False, 0.4, -0.2, 1.2, 0.0, 1.7)
LAND = struct.pack("<BBff?f", 8, 0, 0.0, 0.0, False, 1.0)
AT_REST = Telemetry(position=(0.1, 0.2, 0.0), motors=(36000,) * 4)


def connected():
    drone = SimulatedCrazyflie("cf")
    drone.attach(lambda port, channel, data: None)
    return drone


def asked(drone, first, last, telemetry=AT_REST):
    """The ticks at which it wanted telemetry."""
    ticks = []
    for k in range(first, last):
        if drone.glance(k * PERIOD) is None:
            drone.tick(k * PERIOD, telemetry)
            ticks.append(k)
    return ticks


def test_a_drone_at_rest_is_asked_at_its_supervisors_rate():
    assert len(asked(connected(), 1, 201)) == pytest.approx(50, abs=2)


def test_a_drone_that_moves_without_a_plan_is_asked_at_every_tick():
    assert len(asked(connected(), 1, 51, AT_REST._replace(velocity=(0.0, 0.0, -1.0)))) == 50


def test_a_command_is_noticed_at_the_next_tick_and_a_ping_not_at_all():
    drone, pinged = connected(), connected()
    usual = asked(drone, 1, 103)
    asked(pinged, 1, 3)
    quiet = next(k for k in range(50, 102) if k not in usual)
    pinged_ticks = []
    for k in range(3, 103):
        pinged.receive(LINK, b"\x00" + bytes(8))
        pinged_ticks += asked(pinged, k, k + 1)
    assert pinged_ticks == [k for k in usual if k >= 3]
    commanded = connected()
    asked(commanded, 1, quiet)
    commanded.receive(HIGH_LEVEL, TAKE_OFF)
    assert asked(commanded, quiet, quiet + 1) == [quiet]


def test_poses_reach_the_filter_without_a_tick():
    drone = connected()
    ticks = asked(drone, 1, 50)
    quiet = next(k for k in range(50, 60) if (k - ticks[-1]) % 4)
    drone.receive(LOCALIZATION, struct.pack("<fff", 1.0, 2.0, 3.0))
    (measured,) = drone.glance(quiet * PERIOD)
    assert (measured.position, measured.quaternion) == ((1.0, 2.0, 3.0), None)
    assert drone.glance((quiet + 0.5) * PERIOD) == ()


def test_asking_less_changes_no_setpoint():
    """Take-off, a go-to in the middle of it, landing: ticked at all times, and asked only when it wants to be."""
    patient, eager, table = connected(), connected(), SetpointTable(1)
    commands = {37: TAKE_OFF, 111: GO_TO, 320: LAND}
    held, often = Setpoint(), 0
    for k in range(1, 480):
        if k in commands:
            for drone in (patient, eager):
                drone.receive(HIGH_LEVEL, commands[k])
        t = k * PERIOD
        told = eager.tick(t, AT_REST).setpoint
        if patient.glance(t) is None:
            orders = patient.tick(t, AT_REST)
            table.take(0, orders.setpoint, orders.course)
            held, often = orders.setpoint, often + 1
        table.turn(k)
        assert MODES[table.mode[0]] is told.mode is held.mode
        if told.mode is SetpointMode.FULL:
            vectors = (told.position, told.velocity, told.acceleration, told.omega)
            np.testing.assert_allclose(table.position[0], told.position, atol=1e-6)
            np.testing.assert_allclose(table.ahead[0], np.concatenate(vectors[1:]), atol=1e-5)
            assert table.yaw[0] == pytest.approx(told.yaw, abs=1e-6)
    assert often < 480 / 3
