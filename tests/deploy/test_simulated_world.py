"""Firmware and physics together, without cflib: what a drone does when it is asked by packets."""

import math
import struct

import numpy as np
import pytest

from deploy.radio.simulated.crazyflie import SimulatedCrazyflie
from deploy.radio.simulated.decks import DECKS
from deploy.radio.simulated.interface import PoseMeasurement
from deploy.radio.simulated.physics.sensors import SensorNoise
from deploy.radio.simulated.physics.world import World
from deploy.radio.simulated.toc import log_toc
from deploy.radio.simulated.variables import Snapshot, live_variables
from missions.airframes import airframe


class Drone:
    """One drone on the floor at (0, 0) under motion capture at 100 Hz, until ``blind``."""

    def __init__(self, kind="cf21", *, charge=0.95, noise=None, seed=0, **options):
        frame = airframe(kind)
        options.setdefault("auto_arm", "brushless" not in kind)
        self.firmware = SimulatedCrazyflie("cf", airframe=frame, **options)
        noise = noise or SensorNoise.none()
        self.world = World([frame], np.zeros((1, 3)), np.zeros(1), noise=noise, seed=seed, charge=charge)
        self.world.attach([self.firmware])
        self.world.every(0.01, self._look)
        self.blind = False
        self.t = 0.0
        self.received = []
        self.firmware.attach(lambda port, channel, data: self.received.append((port, channel, bytes(data))))
        self.set("kalman.resetEstimation", 1, "B")
        self.advance(1.0)

    def _look(self, t):
        if not self.blind:
            self.firmware.sense(
                PoseMeasurement(tuple(self.world.positions[0].tolist()), tuple(self.world.quaternions[0].tolist()))
            )

    def set(self, name, value, form="f"):
        toc = self.firmware._parameters.toc
        self.send(2, 2, struct.pack("<H" + form, toc.index[name], value))

    def send(self, port, channel, data):
        self.firmware.receive(port << 4 | channel, data)

    def advance(self, seconds):
        self.t += seconds
        self.world.advance(self.t)

    def take_off(self, height=1.0, seconds=1.5):
        self.send(8, 0, b"\x07" + struct.pack("<Bff?f", 0, height, 0.0, True, seconds))
        self.advance(seconds + 1.0)

    def stream(self, packet, seconds, port=7):
        for _ in range(round(seconds / 0.1)):
            self.send(port, 0, packet)
            self.advance(0.1)

    @property
    def position(self):
        return self.world.positions[0]

    @property
    def velocity(self):
        return self.world.velocities[0]

    @property
    def yaw(self):
        x, y, z, w = self.world.quaternions[0]
        return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


@pytest.fixture
def flying():
    drone = Drone()
    drone.take_off()
    assert drone.position[2] == pytest.approx(1.0, abs=0.12)
    return drone


@pytest.mark.parametrize(("new", "sign"), [(b"\x0a", 1), (b"\x05", -1)])
def test_hover_holds_its_height_goes_ahead_and_turns_the_way_its_protocol_says(flying, new, sign):
    flying.stream(new + struct.pack("<ffff", 0.3, 0.0, 30.0, 1.2), 2.0)
    assert flying.position[2] == pytest.approx(1.2, abs=0.12)
    assert math.copysign(1, flying.yaw) == sign
    assert abs(flying.yaw) == pytest.approx(math.radians(60), abs=0.15)
    assert math.hypot(*flying.velocity[:2]) == pytest.approx(0.3, abs=0.12)


def test_z_distance_leans_at_a_height(flying):
    flying.stream(b"\x09" + struct.pack("<ffff", 0.0, 5.0, 0.0, 1.3), 2.0)
    assert flying.position[2] == pytest.approx(1.3, abs=0.12)
    assert flying.velocity[0] < -0.8  # the wire's pitch is nose up: backwards


def test_altitude_hold_climbs(flying):
    flying.stream(b"\x04" + struct.pack("<ffff", 0.0, 0.0, 0.0, 0.3), 2.0)
    assert flying.velocity[2] == pytest.approx(0.3, abs=0.05)


def test_manual_and_remote_control_set_thrust(flying):
    flying.stream(b"\x0b" + struct.pack("<fffH?", 0.0, 0.0, 0.0, 45000, False), 0.5)
    climbing = flying.velocity[2]
    assert climbing > 0.5
    flying.stream(b"\x03" + struct.pack("<BHHHH", 0, 1500, 1500, 1500, 1300), 0.5)
    assert flying.velocity[2] < climbing - 1.0


def test_setpoints_of_other_types_fly_where_they_say(flying):
    flying.stream(b"\x07" + struct.pack("<ffff", 0.3, -0.2, 1.1, 45.0), 4.0)
    np.testing.assert_allclose(flying.position, (0.3, -0.2, 1.1), atol=0.12)
    assert flying.yaw == pytest.approx(math.pi / 4, abs=0.05)
    flying.stream(b"\x06" + struct.pack("<9hI3h", 0, 0, 900, *[0] * 6, 0xC0000000, 0, 0, 0), 4.0)
    np.testing.assert_allclose(flying.position, (0.0, 0.0, 0.9), atol=0.12)
    flying.stream(b"\x00", 0.3)
    assert flying.velocity[2] < -2.0  # a stop is a fall


def test_a_low_level_setpoint_keeps_its_priority_until_notified(flying):
    go_to = b"\x0c" + struct.pack("<B??fffff", 0, False, False, 0.5, 0.0, 1.0, 0.0, 1.5)
    flying.stream(b"\x07" + struct.pack("<ffff", 0.0, 0.0, 1.0, 0.0), 0.5)
    flying.send(8, 0, go_to)
    flying.stream(b"\x07" + struct.pack("<ffff", 0.0, 0.0, 1.0, 0.0), 2.0)
    assert abs(flying.position[0]) < 0.05  # answered with 0, cancelled by the next setpoint
    flying.send(7, 1, b"\0" + struct.pack("<I", 0))
    flying.send(8, 0, go_to)
    flying.advance(3.5)
    assert flying.position[0] == pytest.approx(0.5, abs=0.06)


def test_a_client_that_falls_silent_levels_the_drone_and_then_it_falls(flying):
    flying.stream(b"\x0a" + struct.pack("<ffff", 0.4, 0.0, 0.0, 1.0), 1.5)
    flying.advance(1.0)  # level, at its height, gliding on
    assert flying.position[2] == pytest.approx(1.0, abs=0.12)
    assert flying.velocity[0] > 0.2
    flying.advance(2.5)
    assert flying.position[2] == 0.0
    assert flying.firmware.info & 0x40  # locked


def test_without_poses_the_estimate_drifts_away_and_the_drone_with_it():
    drone = Drone(noise=SensorNoise(), seed=3)
    drone.take_off()
    before = drone.position.copy()
    drone.blind = True
    drone.advance(3.0)
    drift = math.dist(drone.position, before)
    assert 0.02 < drift < 3.0  # centimetres to metres: a biased accelerometer of 0.02 m/s² alone makes 9 cm
    doubt = drone.firmware._snapshot.telemetry.variance_position
    assert min(doubt) > 1e-5
    drone.blind = False
    drone.advance(3.0)
    assert math.dist(drone.position, before) < 0.1


def test_poses_of_others_are_nobody_elses_business(flying):
    other = struct.pack("<Bhhh", 77, 9000, 9000, 9000)
    for _ in range(50):
        flying.send(6, 2, other)
        flying.send(6, 1, b"\x02" + bytes(20))  # LPS: goes to the deck, if there is one
        flying.send(6, 1, b"\x0b\0\0\0\0")  # lighthouse: nothing to persist
        flying.advance(0.02)
    np.testing.assert_allclose(flying.position, (0.0, 0.0, 1.0), atol=0.12)


CONSTANT = {  # groups of the log table of which nothing lives, as the package's docstring says
    "crtp", "colAv", "sensfusion6", "mag", "posEstAlt", "estimator", "outlierf", "kalman_pred", "ukf", "sensorFilter",
    "navFilter", "pid_rate", "pid_attitude", "ctrlINDI", "posCtrlIndi", "ctrlLee", "health",
}  # fmt: skip


def test_groups_of_which_nothing_lives_are_those_that_are_documented():
    decks = tuple(DECKS.values())
    live = {name.split(".")[0] for name in live_variables(Snapshot(decks=decks))}
    assert {entry.group for entry in log_toc().entries} - live == CONSTANT
    assert all(name in log_toc().index for name in live_variables(Snapshot(decks=decks)))


def reads(drone, *names):
    getters = live_variables(drone.firmware._snapshot)
    return [getters[name]() for name in names]


@pytest.mark.parametrize(("controller", "group"), [(1, "controller"), (2, "ctrlMel")])
def test_commands_of_the_controller_in_charge_live(controller, group):
    drone = Drone(decks=("bcFlow2", "bcLighthouse4"))
    drone.set("stabilizer.controller", controller, "B")
    drone.take_off()
    drone.stream(b"\x07" + struct.pack("<ffff", 2.0, 0.0, 1.0, 0.0), 0.3)  # ahead: nose down
    thrust, pitch, m1, m2 = reads(drone, f"{group}.cmd_thrust", f"{group}.cmd_pitch", "motor.m1", "motor.m2")
    assert 25000 < thrust < 55000
    assert m1 - m2 == pytest.approx(pitch, abs=2.0)  # front right less back right, the mixer's legacy pitch
    other = "ctrlMel" if group == "controller" else "controller"
    assert reads(drone, f"{other}.cmd_thrust") == [0.0]


def test_what_pid_aims_at_barometer_and_decks_live():
    drone = Drone(decks=("bcFlow2", "bcLighthouse4"))
    drone.take_off()
    drone.stream(b"\x07" + struct.pack("<ffff", 2.0, 0.0, 1.0, 0.0), 0.3)
    aimed, rate, body_x, target = reads(
        drone, "controller.pitch", "controller.pitchRate", "posCtl.bodyX", "posCtl.targetX"
    )
    assert -21.0 < aimed < -10.0  # nose down
    assert rate != 0.0
    assert (body_x, target) == pytest.approx((drone.position[0], 2.0), abs=0.05)
    height = drone.position[2]
    asl, pressure, down, status = reads(drone, "baro.asl", "baro.pressure", "range.zrange", "lighthouse.status")
    assert asl == pytest.approx(height, abs=0.01)
    assert pressure == pytest.approx(1013.25 - 0.12 * height, abs=0.02)
    assert down == pytest.approx(1000.0 * height, rel=0.12)  # along a tilted axis
    assert status == 2
    drone.blind = True
    drone.advance(0.6)
    assert reads(drone, "lighthouse.status") == [0]


@pytest.mark.parametrize("kind", ["cf21", "cf21_brushless"])
def test_a_battery_that_runs_empty_in_flight_drops_the_drone(kind):
    drone = Drone(kind, charge=0.03)
    if not drone.firmware.info & 4:
        drone.send(9, 1, b"\x01\x01")
        drone.advance(0.5)
    drone.take_off(seconds=1.0)
    assert drone.position[2] > 0.9
    drone.advance(25.0)
    assert drone.position[2] == 0.0
    assert drone.firmware.reboots > 0


def test_brushless_needs_an_arming_request_and_disarms_in_flight():
    drone = Drone("cf21_brushless")
    drone.take_off(seconds=0.5)
    assert drone.position[2] == 0.0
    drone.send(9, 1, b"\x01\x01")
    drone.advance(0.5)
    drone.take_off()
    assert drone.position[2] == pytest.approx(1.0, abs=0.12)
    drone.send(9, 1, b"\x01\x00")
    drone.advance(2.0)
    assert drone.position[2] == 0.0
    assert not drone.firmware.info & 0x0A  # neither armed nor able to fly
