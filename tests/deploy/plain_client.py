"""A client of Crazyflies written with cflib alone: run as a program, it knows nothing of this project.

``fly URI…`` makes a Swarm do what swarms do and lands it; ``hover URI`` takes off, says so and waits to be killed;
``rescue URI`` connects to a drone that flies without a client and lands it.
"""

import sys
import threading
import time

import cflib.crtp
from cflib.crazyflie import Crazyflie
from cflib.crazyflie.log import LogConfig
from cflib.crazyflie.mem import MemoryElement, Poly4D
from cflib.crazyflie.swarm import Swarm
from cflib.crazyflie.syncCrazyflie import SyncCrazyflie

PATIENCE = 15.0  # [s]
HEIGHT = 0.4  # [m]


class Watch:
    """The drone's own view of itself, ten times a second."""

    def __init__(self, scf: SyncCrazyflie) -> None:
        self.rows: list[dict[str, float]] = []
        self._news = threading.Condition()
        config = LogConfig("watch", 100)
        for name in ("stateEstimate.x", "stateEstimate.y", "stateEstimate.z", "supervisor.info", "pm.vbat"):
            config.add_variable(name)
        config.data_received_cb.add_callback(self._arrived)
        scf.cf.log.add_config(config)
        config.start()
        self.until(lambda row: True)

    def until(self, holds) -> dict[str, float]:
        """Wait for a row for which something holds."""
        with self._news:
            assert self._news.wait_for(lambda: self.rows and holds(self.rows[-1]), PATIENCE), self.rows[-1:]
            return self.rows[-1]

    def _arrived(self, stamp: int, row: dict[str, float], _: object) -> None:
        with self._news:
            self.rows.append(row)
            self._news.notify_all()


def near(row: dict[str, float], x: float, y: float, z: float) -> bool:
    return all(abs(row[f"stateEstimate.{axis}"] - value) < 0.06 for axis, value in zip("xyz", (x, y, z), strict=True))


def landed(row: dict[str, float]) -> bool:
    """On the ground, and the supervisor knows: who closes the link earlier finds the drone locked."""
    return row["stateEstimate.z"] < 0.05 and not int(row["supervisor.info"]) & 0x10


def mission(scf: SyncCrazyflie) -> None:
    """Parameters, take-off, go_to, upload, a trajectory, landing."""
    cf, commander = scf.cf, scf.cf.high_level_commander
    scf.wait_for_params()
    cf.param.set_value("stabilizer.controller", "2")
    echo = threading.Event()
    cf.param.add_update_callback("hlCommander", "vland", lambda *_: echo.set())
    cf.param.set_value("hlCommander.vland", "0.3")
    assert echo.wait(PATIENCE)
    assert abs(float(cf.param.get_value("hlCommander.vland")) - 0.3) < 1e-6
    assert cf.supervisor.can_fly
    watch = Watch(scf)
    assert 3.0 < watch.rows[-1]["pm.vbat"] < 4.3
    home = watch.until(lambda row: True)
    x, y = home["stateEstimate.x"], home["stateEstimate.y"]
    commander.takeoff(HEIGHT, 1.0)
    watch.until(lambda row: near(row, x, y, HEIGHT))
    commander.go_to(x + 0.3, y, HEIGHT, 0.0, 1.0)
    watch.until(lambda row: near(row, x + 0.3, y, HEIGHT))
    memory = cf.mem.get_mems(MemoryElement.TYPE_TRAJ)[0]
    back = Poly4D.Poly([0.0, -0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    still = [Poly4D.Poly([0.0] * 8) for _ in range(3)]
    memory.trajectory = [Poly4D(1.0, back, *still)]
    assert memory.write_data_sync()
    commander.define_trajectory(1, 0, 1)
    commander.start_trajectory(1, relative_position=True)
    watch.until(lambda row: near(row, x, y, HEIGHT))
    commander.land(0.0, 1.0)
    watch.until(landed)


def fly(uris: list[str]) -> None:
    with Swarm(set(uris)) as swarm:
        swarm.parallel_safe(mission)


def hover(uri: str) -> None:
    with SyncCrazyflie(uri, cf=Crazyflie()) as scf:
        watch = Watch(scf)
        scf.cf.high_level_commander.takeoff(HEIGHT, 1.0)
        watch.until(lambda row: row["stateEstimate.z"] > 0.8 * HEIGHT)
        sys.stdout.write("hovering\n")
        sys.stdout.flush()
        time.sleep(10 * PATIENCE)


def rescue(uri: str) -> None:
    with SyncCrazyflie(uri, cf=Crazyflie()) as scf:
        watch = Watch(scf)
        assert watch.rows[-1]["stateEstimate.z"] > 0.8 * HEIGHT, "it did not go on without us"
        scf.cf.high_level_commander.land(0.0, 1.0)
        watch.until(landed)
    with SyncCrazyflie(uri, cf=Crazyflie()) as scf:  # the zero setpoint of close_link has priority until notified
        watch = Watch(scf)
        watch.until(lambda row: int(row["supervisor.info"]) & 0x18 == 0x08)  # can fly, does not
        scf.cf.high_level_commander.takeoff(HEIGHT, 1.0)
        seen = len(watch.rows)
        watch.until(lambda row: len(watch.rows) >= seen + 5)
        assert landed(watch.rows[-1]), "closing the link before should have kept it on the ground"
        scf.cf.commander.send_notify_setpoint_stop()
        scf.cf.high_level_commander.stop()
        scf.cf.high_level_commander.takeoff(HEIGHT, 1.0)
        watch.until(lambda row: row["stateEstimate.z"] > 0.8 * HEIGHT)  # and drops when the link is closed


if __name__ == "__main__":
    cflib.crtp.init_drivers()
    if sys.argv[1] == "fly":
        fly(sys.argv[2:])
    else:
        {"hover": hover, "rescue": rescue}[sys.argv[1]](sys.argv[2])
