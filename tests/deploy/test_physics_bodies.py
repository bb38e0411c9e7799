import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deploy.radio.simulated.physics import algebra, ground
from deploy.radio.simulated.physics.algebra import GRAVITY
from deploy.radio.simulated.physics.battery import Batteries
from deploy.radio.simulated.physics.downwash import downwash
from deploy.radio.simulated.physics.mixer import mix
from deploy.radio.simulated.physics.rigid_body import RigidBodies
from deploy.radio.simulated.physics.rotors import Rotors
from deploy.radio.simulated.physics.tumble import TumbleDetector
from missions.airframes import airframe

CF = airframe("cf21")
DT = 0.002
rotation_vectors = st.tuples(*[st.floats(-1.7, 1.7)] * 3).map(lambda v: np.array([v]))


def body(dt=DT, height=10.0):
    bodies = RigidBodies([CF], np.array([[0.0, 0.0, height]]), np.zeros(1), dt)
    bodies.refresh()
    return bodies


@given(rotation_vectors, rotation_vectors)
def test_quaternion_product_is_the_product_of_the_matrices(a, b):
    p, q = algebra.exponential(a), algebra.exponential(b)
    both = algebra.rotation_matrices(algebra.multiply(p, q))
    np.testing.assert_allclose(both, algebra.rotation_matrices(p) @ algebra.rotation_matrices(q), atol=1e-12)


@given(rotation_vectors)
def test_logarithm_undoes_exponential_and_its_sign(v):
    q = algebra.exponential(v)
    np.testing.assert_allclose(algebra.logarithm(q), v, atol=1e-7)
    np.testing.assert_allclose(algebra.logarithm(-q), v, atol=1e-7)


@given(rotation_vectors, rotation_vectors)
def test_skew_and_cross_agree_with_numpy(a, b):
    np.testing.assert_allclose(algebra.cross(a, b), np.cross(a, b), atol=1e-12)
    np.testing.assert_allclose((algebra.skew(a) @ b[:, :, None])[:, :, 0], np.cross(a, b), atol=1e-12)


@given(rotation_vectors, rotation_vectors)
def test_rate_map_is_the_derivative_of_the_attitude(v, omega):
    q, h = algebra.exponential(v), 1e-6
    rate = (q[:, :, None] * omega[:, None, :]).reshape(1, 12).dot(algebra.RATE)
    difference = algebra.multiply(q, algebra.exponential(h * omega)) - algebra.multiply(
        q, algebra.exponential(-h * omega)
    )
    np.testing.assert_allclose(rate, difference / (2 * h), atol=1e-8)


def test_free_fall_is_a_parabola_less_drag():
    bodies = body()
    for _ in range(250):
        bodies.step(np.zeros((1, 4)))
    assert 10.0 - bodies.position[0, 2] == pytest.approx(0.5 * GRAVITY * 0.5**2, rel=5e-3)
    assert bodies.velocity[0, 2] == pytest.approx(-GRAVITY * 0.5, rel=1e-9)


def test_drag_slows_down_by_the_airframes_coefficient():
    bodies = body()
    bodies.velocity[0] = (2.0, 0.0, 0.0)
    bodies.refresh()
    bodies.step(np.array([[GRAVITY, 0.0, 0.0, 0.0]]))
    assert bodies.velocity[0, 0] == pytest.approx(2.0 * (1.0 - DT * CF.drag[0] / CF.mass), abs=1e-12)
    assert bodies.velocity[0, 2] == pytest.approx(0.0, abs=1e-12)


def test_torque_free_tumbling_keeps_energy_and_angular_momentum():
    inertia = np.array(CF.inertia)
    bodies = body(dt=2e-4)
    bodies.rates[0] = (3.0, 5.0, 8.0)
    bodies.update()

    def invariants():
        rates = bodies.rates[0]
        momentum = algebra.rotation_matrices(algebra.normalised(bodies.quaternion))[0] @ (inertia * rates)
        return np.append(momentum, 0.5 * (inertia * rates) @ rates)

    before = invariants()
    for _ in range(2500):
        bodies.step(np.zeros((1, 4)))
    np.testing.assert_allclose(invariants(), before, rtol=0.01, atol=0.01 * np.abs(before[:3]).max())


@pytest.mark.parametrize(("motor", "signs"), [(0, (-1, -1, -1)), (1, (-1, 1, 1)), (2, (1, 1, -1)), (3, (1, -1, 1))])
def test_every_motor_turns_the_drone_its_own_way(motor, signs):
    rotors = Rotors([CF], DT)
    rotors.thrust[0, motor] = 1.0
    specific, *angular = rotors.accelerations()[0]
    assert specific == pytest.approx(CF.motor_thrust_max / CF.mass)
    assert tuple(np.sign(angular)) == signs
    assert abs(angular[2]) == pytest.approx(CF.motor_thrust_max * CF.torque_per_thrust / CF.inertia[2])


def test_mixer_and_rotors_agree_on_the_directions():
    for axis in range(3):
        moments = np.zeros((1, 3))
        moments[0, axis] = 2000.0
        rotors = Rotors([CF], DT)
        rotors.thrust[:] = mix(np.array([[30000.0]]), moments) / 65535.0
        angular = rotors.accelerations()[0, 1:]
        assert angular[axis] > 0.0
        assert np.abs(np.delete(angular, axis)).max() < 1e-9


def test_full_command_gives_way_in_thrust_not_in_moments():
    command = mix(np.array([[65000.0]]), np.array([[4000.0, 0.0, 0.0]]))
    assert command.max() == 65535.0
    assert command[0, 3] - command[0, 0] == pytest.approx(4000.0)


@pytest.mark.parametrize(("begin", "command", "tau"), [(0.0, 65535.0, CF.motor_tau_up), (1.0, 0.0, CF.motor_tau_down)])
def test_motors_lag_with_their_time_constants(begin, command, tau):
    rotors = Rotors([CF], DT)
    rotors.thrust[:] = begin
    steps = 10
    for _ in range(steps):
        rotors.step(np.full((1, 4), command))
    left = np.exp(-steps * DT / tau)
    np.testing.assert_allclose(rotors.thrust, command / 65535.0 + (begin - command / 65535.0) * left, atol=1e-12)


def test_a_broken_motor_gives_no_thrust():
    rotors = Rotors([CF], DT)
    rotors.health[0, 2] = 0.0
    rotors.limit(np.ones(1))
    for _ in range(100):
        rotors.step(np.full((1, 4), 40000.0))
    assert rotors.thrust[0, 2] == 0.0
    assert rotors.thrust[0, 0] == pytest.approx(40000.0 / 65535.0, rel=1e-3)


@settings(max_examples=30)
@given(st.floats(-5.0, 0.0), st.floats(-2.0, 2.0), rotation_vectors)
def test_nothing_sinks_into_the_floor_and_everything_comes_to_rest(fall, slide, tilt):
    bodies = body(height=0.0)
    bodies.velocity[0] = (slide, 0.0, fall)
    bodies.quaternion[:] = algebra.exponential(tilt)
    for k in range(1000):
        if k % 5 == 0:
            bodies.refresh()
        bodies.step(np.zeros((1, 4)))
        ground.resolve(bodies, DT)
        assert bodies.position[0, 2] >= 0.0
    assert not bodies.velocity.any()
    assert not bodies.rates.any()


def test_upright_drones_settle_on_their_legs_and_keep_their_heading():
    bodies = body(height=0.0)
    yaw = algebra.yaw_quaternions(np.array([2.5]))
    bodies.quaternion[:] = algebra.multiply(yaw, algebra.exponential(np.array([[0.5, 0.3, 0.0]])))
    bodies.refresh()
    heading = algebra.heading(bodies.rotation)[0]
    for _ in range(500):
        bodies.step(np.zeros((1, 4)))
        ground.resolve(bodies, DT)
    assert bodies.rotation[0, 2, 2] == pytest.approx(1.0, abs=1e-6)
    assert algebra.heading(bodies.rotation)[0] == pytest.approx(heading, abs=0.05)


@pytest.mark.parametrize(("kind", "minutes"), [("cf21", 7.0), ("cf21_thrust_upgrade", 9.2), ("cf21_brushless", 10.0)])
def test_hover_lasts_as_long_as_the_specification_says(kind, minutes):
    frame = airframe(kind)
    battery = Batteries([frame], charge=1.0)
    hover = frame.mass * GRAVITY / (4.0 * frame.motor_thrust_max)
    lowest, seconds = 5.0, 0
    while battery.charge[0] > 0.0:
        lowest = battery.voltage[0]
        battery.draw(np.full((1, 4), hover), 1.0)
        seconds += 1
    assert seconds / 60.0 == pytest.approx(minutes, abs=0.75)
    assert lowest < 2.7  # the last seconds are below the pack's own 3 V: it sags
    assert battery.voltage[0] == 0.0
    assert battery.available_thrust()[0] == 0.0


def test_voltage_sags_under_load_and_recovers():
    battery = Batteries([CF])
    at_rest = battery.voltage[0]
    for _ in range(20):
        battery.draw(np.full((1, 4), 0.59), 0.01)
    assert 0.2 < at_rest - battery.voltage[0] < 0.6
    for _ in range(20):
        battery.draw(np.zeros((1, 4)), 0.01)
    assert battery.voltage[0] == pytest.approx(at_rest, abs=0.01)


def test_a_low_battery_cannot_give_full_thrust():
    assert Batteries([CF], charge=1.0).available_thrust()[0] == 1.0
    low = Batteries([CF], charge=0.03)
    for _ in range(100):
        low.draw(np.full((1, 4), low.available_thrust()[0]), 0.01)
    assert 0.3 < low.available_thrust()[0] < 0.95


def test_downwash_pushes_the_lower_drone_only_and_fades_sideways_and_downwards():
    weight = CF.mass * GRAVITY

    def force(dx, dz):
        return downwash(np.array([[0.0, 0.0, 1.5], [dx, 0.0, 1.5 - dz]]), np.full(2, weight))

    upper, lower = force(0.0, 0.3)
    assert upper == 0.0
    assert lower == pytest.approx(0.08, abs=0.02)  # about 8 g at 0.3 m, see the module
    assert force(0.0, 1.0)[1] < lower
    assert force(0.5, 0.3)[1] < 0.001
    assert not force(0.3, 0.0).any()


def ticks_until_tumbled(*readings):
    detector = TumbleDetector(1)
    return next((k for k, g in enumerate(readings, 1) if detector.update(GRAVITY * np.array([g]), 0.01)[0]), None)


def test_tumble_is_said_after_a_second_on_the_side_and_at_once_upside_down():
    side, over, upright = (0.0, 1.0, 0.0), (0.0, 0.0, -1.0), (0.0, 0.0, 1.0)
    assert ticks_until_tumbled(*[side] * 200) == 100
    assert ticks_until_tumbled(*[over] * 200) == 10
    assert ticks_until_tumbled(*[upright] * 500) is None
    assert ticks_until_tumbled(*[side] * 50, *[over] * 20) == 51


def test_falling_is_not_tumbling():
    falling, side = (0.05, -0.05, 0.0), (0.0, 1.0, 0.0)
    assert ticks_until_tumbled(*[falling] * 500) is None
    assert ticks_until_tumbled(*[side] * 90, *[falling] * 90, *[side] * 200) == 280 - 1
