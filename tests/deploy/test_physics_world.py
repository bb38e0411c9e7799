import itertools

import numpy as np
import pytest

from deploy.radio.simulated.interface import Orders, PoseMeasurement, Setpoint, SetpointMode
from deploy.radio.simulated.physics.capture import film
from deploy.radio.simulated.physics.sensors import SensorNoise
from deploy.radio.simulated.physics.world import World
from missions.airframes import airframe, airframe_names
from mocap.simulated import SimulatedMocap

PID, MELLINGER = 1, 2


class Pilot:
    """A firmware that sends what the test says and sees the true pose (or nothing) at every tick."""

    def __init__(self, world, index, orders, measure=True):
        self.world, self.index, self.orders, self.measure = world, index, orders, measure
        self.telemetry = []

    def glance(self, t):
        return None

    def tick(self, t, telemetry):
        self.telemetry.append(telemetry)
        orders = self.orders(t) if callable(self.orders) else self.orders
        if not self.measure:
            return orders
        i = self.index
        seen = PoseMeasurement(tuple(self.world.positions[i]), tuple(self.world.quaternions[i]))
        return Orders(orders.setpoint, orders.motors_allowed, orders.controller, (seen,))


def fly(setpoint, seconds, *, controller=MELLINGER, start=((0.0, 0.0, 1.0),), measure=True, **options):
    options.setdefault("noise", SensorNoise.none())
    n = len(start)
    world = World([airframe("cf21")] * n, np.array(start), np.zeros(n), **options)
    order = setpoint if callable(setpoint) else Orders(setpoint, True, controller)
    pilots = [Pilot(world, i, order, measure) for i in range(n)]
    world.attach(pilots)
    world.advance(seconds)
    return world, pilots


def at(x, y, z, mode=SetpointMode.FULL, **rest):
    return Setpoint(mode, (x, y, z), **rest)


@pytest.mark.parametrize("mode", [SetpointMode.FULL, SetpointMode.POSITION])
def test_every_airframe_reaches_a_point_and_a_heading_and_stays_with_either_controller(mode):
    crew = [(kind, controller) for kind in airframe_names() for controller in (PID, MELLINGER)]
    start = np.array([(10.0 * i, 0.0, 1.0) for i in range(len(crew))])
    goal = start + np.array([0.4, -0.3, 0.2])
    world = World([airframe(kind) for kind, _ in crew], start, np.zeros(len(crew)), noise=SensorNoise.none())
    orders = [Orders(at(*point, mode, yaw=1.0), True, crew[i][1]) for i, point in enumerate(goal)]
    world.attach([Pilot(world, i, order) for i, order in enumerate(orders)])
    world.advance(8.0)
    assert np.linalg.norm(world.positions - goal, axis=1).max() < 0.06
    assert np.abs(world.velocities).max() < 0.05
    turned = np.tile((0.0, 0.0, np.sin(0.5), np.cos(0.5)), (len(crew), 1))
    np.testing.assert_allclose(world.quaternions, turned, atol=0.02)


def test_velocity_setpoints_fly_at_that_velocity_and_turn():
    setpoint = Setpoint(SetpointMode.VELOCITY, velocity=(0.3, -0.2, 0.1), omega=(0.0, 0.0, 0.5))
    world, _ = fly(setpoint, 6.0, controller=PID)
    np.testing.assert_allclose(world.velocities[0], (0.3, -0.2, 0.1), atol=0.05)
    assert 2.0 * np.arctan2(world.quaternions[0, 2], world.quaternions[0, 3]) == pytest.approx(3.0, abs=0.3)


def test_hover_setpoints_fly_in_the_body_frame_and_hold_the_height():
    def orders(t):
        if t < 4.0:
            return Orders(at(0.0, 0.0, 1.0, SetpointMode.POSITION, yaw=np.pi / 2), True, PID)
        return Orders(Setpoint(SetpointMode.HOVER, (0.0, 0.0, 1.0), (0.3, 0.0, 0.0)), True, PID)

    world, _ = fly(orders, 8.0)
    np.testing.assert_allclose(world.velocities[0, :2], (0.0, 0.3), atol=0.05)  # ahead is +y after a quarter turn
    assert world.positions[0, 2] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("controller", [PID, MELLINGER])
@pytest.mark.parametrize(("attitude", "axis", "sign"), [((0.1, 0.0), 1, -1), ((0.0, 0.1), 0, 1)])
def test_attitude_setpoints_lean_and_slide_the_right_way(controller, attitude, axis, sign):
    setpoint = Setpoint(SetpointMode.ATTITUDE, attitude=attitude, thrust=39000.0)
    world, _ = fly(setpoint, 1.0, controller=controller)
    assert np.sign(world.velocities[0, axis]) == sign
    assert abs(world.velocities[0, axis]) > 0.3
    assert abs(world.velocities[0, 1 - axis]) < 0.05


@pytest.mark.parametrize("controller", [PID, MELLINGER])
def test_height_setpoints_hold_z_and_only_pid_leans(controller):
    setpoint = Setpoint(SetpointMode.HEIGHT, (0.0, 0.0, 1.2), attitude=(0.0, 0.1))
    world, _ = fly(setpoint, 3.0, controller=controller)
    assert world.positions[0, 2] == pytest.approx(1.2, abs=0.06)
    if controller == PID:
        assert world.velocities[0, 0] > 0.5
    else:  # an unknown combination of modes for it: it levels out
        assert abs(world.velocities[0, 0]) < 0.05


def test_climb_setpoints_climb_at_that_rate_and_slide_where_they_lean():
    setpoint = Setpoint(SetpointMode.CLIMB, velocity=(0.0, 0.0, 0.3), attitude=(0.1, 0.0))
    world, _ = fly(setpoint, 3.0, controller=PID)
    assert world.velocities[0, 2] == pytest.approx(0.3, abs=0.05)
    assert world.velocities[0, 1] < -0.5


def test_rate_setpoints_turn_at_those_rates():
    rates = (0.5, -0.4, 0.3)
    setpoint = Setpoint(SetpointMode.RATES, omega=rates, thrust=39000.0)
    _, pilots = fly(setpoint, 0.6, controller=PID, start=((0.0, 0.0, 3.0),))
    np.testing.assert_allclose(pilots[0].telemetry[-1].gyro, rates, atol=0.1)  # yaw by way of a moving angle


def test_without_the_supervisors_word_or_with_mode_off_nothing_turns():
    for orders in (Orders(at(0.0, 0.0, 1.0), False, MELLINGER), Orders(Setpoint(), True, MELLINGER)):
        world, pilots = fly(lambda t, orders=orders: orders, 1.0, start=((0.0, 0.0, 0.0),))
        assert not world.motors.any()
        assert not world.positions.any()
        assert pilots[0].telemetry[-1].thrust == 0.0


def test_cutting_the_motors_in_flight_drops_the_drone_and_it_stays_down():
    world, pilots = fly(lambda t: Orders(at(0.0, 0.0, 1.0), t < 1.0, MELLINGER), 3.0)
    assert world.positions[0, 2] == 0.0
    assert not world.velocities.any()
    assert min(x.accelerometer[2] for x in pilots[0].telemetry) < 0.1  # weightless while it fell


def test_same_seed_same_flight_and_other_seed_another():
    start = ((0.0, 0.0, 0.0), (0.5, 0.0, 0.0))

    def path(seed):
        world, pilots = fly(at(0.2, 0.0, 0.5), 1.5, start=start, noise=SensorNoise(), seed=seed)
        return world.positions, [p.telemetry[-1] for p in pilots]

    first, again, other = path(7), path(7), path(8)
    assert (first[0] == again[0]).all()
    assert first[1] == again[1]
    assert (first[0] != other[0]).any()


def test_steps_of_the_caller_do_not_change_the_flight():
    def path(stops):
        world = World([airframe("cf21")], np.zeros((1, 3)), np.zeros(1), seed=3)
        world.attach([Pilot(world, 0, Orders(at(0.1, 0.2, 0.5), True, MELLINGER))])
        for t in stops:
            world.advance(t)
        return world.positions

    assert (path([1.0]) == path([0.004, 0.0145, 0.02, 0.02, 0.0333, 1.0])).all()


def test_drones_do_not_influence_each_other_unless_one_is_in_the_others_wake():
    alone, _ = fly(at(0.0, 0.0, 1.0), 2.0)
    beside, _ = fly(at(0.0, 0.0, 1.0), 2.0, start=((0.0, 0.0, 1.0), (50.0, 0.0, 1.0)))
    np.testing.assert_allclose(beside.positions[0], alone.positions[0], atol=1e-12)


def test_a_drone_below_another_is_pushed_down():
    world = World([airframe("cf21")] * 2, np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.6]]), np.zeros(2))
    world.attach([Pilot(world, i, Orders(at(0.0, 0.0, z), True, MELLINGER)) for i, z in enumerate((1.0, 0.6))])
    world.advance(3.0)
    assert world.positions[0, 2] == pytest.approx(1.0, abs=0.015)
    assert world.positions[1, 2] < 0.57


def test_estimate_drifts_without_poses_and_says_so():
    world, (pilot,) = fly(at(0.0, 0.0, 1.0), 4.0, noise=SensorNoise(), seed=5)
    assert np.sqrt(max(pilot.telemetry[-1].variance_position)) < 0.01
    blind = world.t
    pilot.measure = False
    spread = []
    for k in range(5):
        world.advance(blind + k + 1)
        spread.append(pilot.telemetry[-1].variance_position[0])
    assert all(a < b for a, b in itertools.pairwise(spread))
    wrong = np.linalg.norm(np.array(pilot.telemetry[-1].position) - world.positions[0])
    assert wrong > 0.05


def test_a_wrong_pose_misleads_the_estimate_and_the_drone():
    world, (pilot,) = fly(at(0.0, 0.0, 1.0), 2.0)
    pilot.measure = False
    shifted = lambda: PoseMeasurement(tuple(world.positions[0] + (0.5, 0.0, 0.0)), None)  # noqa: E731
    pilot.orders = lambda t: Orders(at(0.0, 0.0, 1.0), True, MELLINGER, (shifted(),))
    world.advance(8.0)
    assert world.positions[0, 0] == pytest.approx(-0.5, abs=0.1)
    assert pilot.telemetry[-1].position[0] == pytest.approx(0.0, abs=0.1)


def test_reset_starts_at_the_initial_pose_and_the_first_pose_corrects_it():
    world = World([airframe("cf21")], np.array([[1.0, 2.0, 0.0]]), np.array([0.5]), noise=SensorNoise.none())
    pilot = Pilot(world, 0, Orders(reset_estimator=True, initial_pose=((0.7, 2.2, 0.0), 0.4)), measure=False)
    world.attach([pilot])
    world.advance(0.02)
    assert pilot.telemetry[-1].position == pytest.approx((0.7, 2.2, 0.0), abs=1e-6)
    assert 2.0 * np.arcsin(pilot.telemetry[-1].quaternion[2]) == pytest.approx(0.4, abs=1e-6)
    assert pilot.telemetry[-1].variance_position[0] > 1000.0
    pilot.orders, pilot.measure = Orders(), True
    world.advance(1.0)
    assert pilot.telemetry[-1].position == pytest.approx((1.0, 2.0, 0.0), abs=1e-3)
    assert 2.0 * np.arcsin(pilot.telemetry[-1].quaternion[2]) == pytest.approx(0.5, abs=1e-2)
    assert pilot.telemetry[-1].variance_position[0] < 1e-3


def test_telemetry_on_the_ground_reads_one_g_and_a_resting_battery():
    _, (pilot,) = fly(Setpoint(), 0.5, start=((0.0, 0.0, 0.0),))
    last = pilot.telemetry[-1]
    assert last.accelerometer == pytest.approx((0.0, 0.0, 1.0), abs=1e-9)
    assert last.acceleration == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert not last.tumbled
    assert 4.0 < last.battery_voltage < 4.2


def test_observers_are_called_at_their_period_and_see_the_world():
    world = World([airframe("cf21")], np.zeros((1, 3)), np.zeros(1))
    seen = []
    world.every(0.015, seen.append)
    world.advance(0.064)
    assert seen == pytest.approx([0.015, 0.030, 0.045, 0.060])
    with pytest.raises(ValueError, match="multiple"):
        world.every(0.004, seen.append)


def test_mocap_films_the_world():
    world = World([airframe("cf21")] * 2, np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 0.0]]), np.zeros(2))
    mocap = SimulatedMocap(50.0, noise_position=0.0, noise_angle=0.0, latency=0.0)
    film(world, ["a", "b"], mocap)
    world.advance(0.1)
    frames = mocap.poll()
    assert [f.t for f in frames] == pytest.approx([0.0, 0.02, 0.04, 0.06, 0.08, 0.1])
    assert frames[-1].bodies["b"].position == (1.0, 2.0, 0.0)


@pytest.mark.parametrize(
    ("positions", "yaws"),
    [(np.zeros((2, 3)), np.zeros(1)), (np.zeros((1, 3)), np.zeros(2)), (np.full((1, 3), -0.1), np.zeros(1))],
)
def test_worlds_that_do_not_fit_are_refused(positions, yaws):
    with pytest.raises(ValueError, match="drone"):
        World([airframe("cf21")], positions, yaws)


def test_truth_is_a_copy_that_cannot_be_written():
    world = World([airframe("cf21")], np.zeros((1, 3)), np.zeros(1))
    with pytest.raises(ValueError, match="read-only"):
        world.positions[0, 0] = 1.0
