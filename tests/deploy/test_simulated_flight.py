"""Whole flights through unmodified cflib, on the real firmware model in the real simulated world."""

import threading

import numpy as np
import pytest
from cflib.crazyflie.swarm import CachedCfFactory, Swarm

from deploy.clock import VirtualClock
from deploy.radio.simulated.driver import unregister
from deploy.radio.simulated.physics.world import World
from deploy.radio.simulated.swarm import SimulatedSwarm
from missions.airframes import airframe
from tests.recordings import recording

CIRCLE = recording("poly4d")["trajectories"][0]
STARTS = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])


def write(scf, image):
    memory = scf.cf.mem.get_mems(0x12)[0]
    done = threading.Event()
    scf.cf.mem.mem_write_cb.add_callback(lambda *_: done.set())
    scf.cf.mem.write(memory, 0, bytearray(image))
    assert done.wait(10.0)


def set_parameter(scf, name, value):
    done = threading.Event()
    group, _, leaf = name.partition(".")
    scf.cf.param.add_update_callback(group=group, name=leaf, cb=lambda _, echo: float(echo) == value and done.set())
    scf.cf.param.set_value(name, str(value))
    assert done.wait(10.0)


class Rehearsal:
    """A flight that feeds perfect external positions every 10 ms and records the truth."""

    def __init__(self, cache):
        self.clock = VirtualClock(patience=20.0)
        self.world = World([airframe("cf21")] * 2, STARTS, np.zeros(2), seed=1)
        self.truth = []
        self.cache = cache

    def feed(self, fleet, seconds):
        end = self.clock.now() + seconds
        crazyflies = [scf.cf for scf in fleet]
        while self.clock.now() < end - 1e-9:
            self.truth.append(self.world.positions)
            for cf, position in zip(crazyflies, self.truth[-1], strict=True):
                cf.extpos.send_extpos(*position)
            self.clock.sleep_until(self.clock.now() + 0.01)

    def fly(self, *, land):
        """Take off and fly the circle; then land, or break off after two seconds of it."""
        with SimulatedSwarm(["a", "b"], self.world, self.clock, label="rehearsal") as swarm:
            uris = list(swarm.uris().values())
            with Swarm(uris, factory=CachedCfFactory(rw_cache=self.cache)) as swarm_of_cflib:
                fleet = [swarm_of_cflib._cfs[uri] for uri in uris]
                for scf in fleet:
                    scf.wait_for_params()
                    write(scf, bytes.fromhex(CIRCLE["image_hex"]))
                    set_parameter(scf, "stabilizer.controller", 2)
                    scf.cf.commander.send_notify_setpoint_stop()
                    scf.cf.high_level_commander.define_trajectory(1, 0, CIRCLE["n_pieces"])
                    set_parameter(scf, "kalman.resetEstimation", 1)
                self.feed(fleet, 1.0)
                self.each(fleet, "takeoff", 1.0, 1.5)
                self.feed(fleet, 2.0)
                self.each(fleet, "start_trajectory", 1, 1.0, True)
                self.feed(fleet, CIRCLE["evals"][0]["total"] + 0.5 if land else 2.0)
                if land:
                    self.each(fleet, "land", 0.0, 1.5)
                    self.feed(fleet, 4.0)
                return [drone.info for drone in swarm.drones.values()], [d.reboots for d in swarm.drones.values()]

    @staticmethod
    def each(fleet, command, *args):
        for scf in fleet:
            getattr(scf.cf.high_level_commander, command)(*args)


@pytest.fixture
def rehearse(tmp_path):
    def run(*, land):
        rehearsal = Rehearsal(str(tmp_path))
        outcome = rehearsal.fly(land=land)
        return np.array(rehearsal.truth), outcome  # (ticks, drones, 3)

    yield run
    unregister()


def test_two_drones_fly_land_and_do_it_again_bit_by_bit(rehearse):
    truth, (infos, reboots) = rehearse(land=True)
    assert infos == [0x020E, 0x020E]
    assert reboots == [0, 0]
    assert truth[300 - 10, :, 2] == pytest.approx(1.0, abs=0.05)
    assert np.abs(truth[-1, :, 2]).max() < 0.02
    offset = truth[:, 1] - truth[:, 0]  # the same trajectory from two start points
    assert np.abs(offset - [2.0, 0.0, 0.0]).max() < 0.15
    assert np.ptp(truth[300:, 0, 0]) > 0.3
    again, _ = rehearse(land=False)
    assert len(again) == 500
    assert np.array_equal(again, truth[: len(again)])
