import pytest

from missions import MissionError, airframe, airframe_names
from missions.airframes import Airframe


@pytest.mark.parametrize("name", airframe_names())
def test_an_airframe_can_hover_and_its_numbers_fit_together(name):
    frame = airframe(name)

    assert isinstance(frame, Airframe)
    assert 1.5 < frame.thrust_to_weight < 3.0
    assert frame.radius > frame.arm
    assert frame.inertia[2] > max(frame.inertia[:2])
    assert frame.inertia[2] < sum(frame.inertia[:2])  # triangle inequality of any rigid body
    flight_minutes = frame.battery_capacity / 1000.0 * 3.7 / frame.hover_power * 60.0
    assert 5.0 < flight_minutes < 12.0
    assert frame.voltage_empty < 3.7 < frame.voltage_full
    assert frame.thrust_per_count * 65535 == pytest.approx(frame.motor_thrust_max)


def test_firmware_thrust_to_weight_ratios():
    # crazyflie-firmware, platform_defaults_{cf2,cf21bl}.h
    ratios = [airframe(name).thrust_to_weight for name in ("cf21", "cf21_thrust_upgrade", "cf21_brushless")]
    assert ratios == pytest.approx([1.69, 2.26, 2.07], abs=0.006)


def test_an_unknown_airframe_lists_the_known_ones():
    with pytest.raises(
        MissionError, match=r"unknown airframe 'cf21_plus'; known airframes: cf21, .*did you mean 'cf21'"
    ):
        airframe("cf21_plus")
