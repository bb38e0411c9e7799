"""Parameters steer: a changed gain changes the flight in the documented direction, and only that drone's."""

import numpy as np
import pytest

from deploy.radio.simulated.interface import Orders, PoseMeasurement, Setpoint, SetpointMode
from deploy.radio.simulated.physics.estimator import Estimators
from deploy.radio.simulated.physics.mellinger import Mellinger
from deploy.radio.simulated.physics.pid import CascadedPid
from deploy.radio.simulated.physics.sensors import SensorNoise
from deploy.radio.simulated.physics.tuning import Tuning
from deploy.radio.simulated.physics.world import World
from deploy.radio.simulated.toc import PARAM_STRUCTS, param_toc
from missions.airframes import airframe

PID, MELLINGER = 1, 2
CF = airframe("cf21")


class Pilot:
    """Flies setpoint(t) with the true pose at every tick and the given parameters."""

    def __init__(self, world, index, setpoint, controller, tuning):
        self.world, self.index, self.setpoint, self.controller, self.tuning = world, index, setpoint, controller, tuning
        self.path = []

    def glance(self, t):
        return None

    def tick(self, t, telemetry):
        i = self.index
        self.path.append((t, *self.world.positions[i], *telemetry.gyro))
        seen = PoseMeasurement(tuple(self.world.positions[i]), tuple(self.world.quaternions[i]))
        return Orders(self.setpoint(t), True, self.controller, (seen,), tuning=self.tuning)


def fly(setpoint, seconds, controller, *tunings):
    """Paths (K, 7) time, position, body rates of one drone for every set of parameters, 10 m apart."""
    start = np.array([(0.0, 10.0 * i, 1.0) for i in range(len(tunings))])
    world = World([CF] * len(tunings), start, np.zeros(len(tunings)), noise=SensorNoise.none())
    at = [lambda t, y=y: setpoint(t, y) for y in start[:, 1]]
    pilots = [Pilot(world, i, at[i], controller, tuning) for i, tuning in enumerate(tunings)]
    world.attach(pilots)
    world.advance(seconds)
    return [np.array(pilot.path) - np.array([0, 0, 10.0 * i, 0, 0, 0, 0]) for i, pilot in enumerate(pilots)]


def step(t, y):
    """A metre ahead and half a metre up after one second."""
    goal = (0.0, y, 1.0) if t < 1.0 else (1.0, y, 1.5)
    return Setpoint(SetpointMode.FULL, goal)


def hover(t, y):
    return Setpoint(SetpointMode.FULL, (0.0, y, 1.0))


def speed(path, axis=1):
    return np.abs(np.diff(path[:, axis])).max() / 0.01


def test_position_gain_and_velocity_limit_of_pid():
    plain, soft, fast, slow = fly(
        step,
        3.0,
        PID,
        {},
        {"posCtlPid.xKp": 0.7},
        {"posCtlPid.xVelMax": 2.0, "posCtlPid.xKp": 4.0, "posCtlPid.pLimit": 30.0},
        {"posCtlPid.xVelMax": 0.3},
    )
    assert speed(slow) == pytest.approx(0.33, abs=0.05)  # with the firmware's overhead of a tenth
    assert speed(slow) < speed(soft) < speed(plain) < speed(fast)


def test_climb_limit_never_falls_below_half_a_metre_a_second():
    slow, slower = fly(step, 3.0, PID, {"posCtlPid.zVelMax": 0.5}, {"posCtlPid.zVelMax": 0.1})
    np.testing.assert_allclose(slow, slower, atol=1e-5)


def test_velocity_feed_forward_and_tilt_limit_of_pid():
    plain, eager, careful = fly(step, 1.6, PID, {}, {"velCtlPid.vxKFF": 10.0}, {"posCtlPid.pLimit": 4.0})
    at = [path[-1, 1] for path in (plain, eager, careful)]
    assert at[1] > at[0] + 0.02
    assert at[2] < at[0] - 0.02


def test_thrust_base_decides_how_far_a_hover_sags_at_first():
    weak, strong = fly(hover, 0.6, PID, {"posCtlPid.thrustBase": 33000.0}, {"posCtlPid.thrustBase": 42000.0})
    assert weak[-1, 3] < 0.99 < 1.01 < strong[-1, 3]


def test_rate_gains_of_pid_damp():
    def turn(t, y):
        return Setpoint(SetpointMode.ATTITUDE, attitude=(0.0 if t < 0.5 else 0.3, 0.0), thrust=39000.0)

    plain, weak = fly(turn, 1.0, PID, {}, {"pid_attitude.roll_kp": 2.0})
    assert np.abs(weak[:, 4]).max() < 0.7 * np.abs(plain[:, 4]).max()


def test_yaw_delta_keeps_the_asked_heading_near():
    def spin(t, y):
        return Setpoint(SetpointMode.HOVER, (0.0, 0.0, 1.0), omega=(0.0, 0.0, 4.0))

    free, tied = fly(spin, 1.0, PID, {}, {"pid_attitude.yawMaxDelta": 3.0})
    assert tied[-1, 6] < 0.5 * free[-1, 6]


def test_mass_and_mass_thrust_of_mellinger_decide_the_height():
    plain, heavy, strong = fly(hover, 4.0, MELLINGER, {}, {"ctrlMel.mass": 0.033}, {"ctrlMel.massThrust": 145000.0})
    assert plain[-1, 3] == pytest.approx(0.992, abs=0.004)
    assert heavy[-1, 3] > plain[-1, 3] + 0.02
    assert strong[-1, 3] > plain[-1, 3] + 0.01


def test_position_gains_of_mellinger():
    plain, stiff, damped = fly(step, 1.8, MELLINGER, {}, {"ctrlMel.kp_xy": 0.8}, {"ctrlMel.kd_xy": 0.4})
    assert stiff[-1, 1] > plain[-1, 1] + 0.05
    assert damped[-1, 1] < plain[-1, 1] - 0.05


def test_attitude_gains_of_mellinger_and_a_vertical_integral():
    plain, slow = fly(step, 1.6, MELLINGER, {}, {"ctrlMel.kR_xy": 20000.0})
    assert np.abs(slow[:, 5]).max() < 0.8 * np.abs(plain[:, 5]).max()
    sagging, lifted = fly(hover, 4.0, MELLINGER, {}, {"ctrlMel.ki_z": 1.5})
    assert abs(lifted[-1, 3] - 1.0) < 0.5 * abs(sagging[-1, 3] - 1.0)


def test_gains_in_flight_change_nobody_else_and_go_back():
    alone = fly(step, 2.0, MELLINGER, {}, {})[0]
    with_other = fly(step, 2.0, MELLINGER, {}, {"ctrlMel.kp_xy": 0.8})[0]
    np.testing.assert_allclose(with_other, alone, atol=1e-9)
    column = np.array([1.0, 2.0])
    tuning = Tuning({"a": column})
    assert tuning.put(1, {"a": 5.0, "b": 1.0})
    np.testing.assert_array_equal(column, (1.0, 5.0))
    assert tuning.put(1, {})
    np.testing.assert_array_equal(column, (1.0, 2.0))
    assert not tuning.put(1, {"b": 2.0})  # nothing of ours


def test_process_noise_of_the_filter_grows_its_doubt():
    estimators = Estimators(2)
    estimators.tune(1, {"kalman.pNAcc_xy": 2.0, "kalman.pNPos": 0.01})
    estimators.covariance[:] = 0.0
    for _ in range(100):
        estimators.predict(np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((2, 3)), 0.01)
    doubt = estimators.variances
    assert doubt[1, 6] == pytest.approx(16.0 * doubt[0, 6])
    assert doubt[1, 3] > doubt[0, 3] + 0.9e-4 * 1000
    np.testing.assert_array_equal(doubt[1, 8], doubt[0, 8])


def test_limits_of_the_filter_are_each_drones_own():
    estimators = Estimators(2)
    estimators.tune(1, {"kalman.maxPos": 5.0})
    bodies = World([CF] * 2, np.array([[6.0, 0.0, 0.0], [6.0, 0.0, 0.0]]), np.zeros(2)).bodies
    assert estimators.lost(estimators.estimates(bodies)).tolist() == [1]


@pytest.mark.parametrize("part", [Mellinger([CF], 0.002), CascadedPid([CF], 0.002), Estimators(1)])
def test_defaults_are_those_of_the_recorded_firmware(part):
    toc = param_toc(False)
    for name, default in part._tuning._defaults.items():
        entry = toc.entries[toc.index[name]]
        recorded = PARAM_STRUCTS[entry.type & 0x0F].unpack(entry.default)[0]
        assert default[0] == pytest.approx(recorded, rel=1e-6), name
