import pytest
from hypothesis import given
from hypothesis import strategies as st

from mocap.offset import WINDOW, ClockOffset


@given(st.floats(-1e6, 1e6), st.lists(st.floats(0.0, 0.05), min_size=1, max_size=50), st.floats(-1e-4, 1e-4))
def test_stamps_are_told_within_the_fastest_delay_and_the_drift(offset, delays, drift):
    clock = ClockOffset()
    for k, delay in enumerate(delays):
        truth = 0.1 * k
        local = clock.to_local(truth * (1.0 + drift) - offset, truth + delay)
        fastest = min(delays[: k + 1])
        assert local <= truth + delay + 1e-9
        assert local - truth == pytest.approx(fastest, abs=1e-4 * 0.1 * (k + 1) + 1e-9)


def test_an_old_fast_message_is_forgotten():
    clock = ClockOffset()
    assert clock.to_local(0.0, 0.001) == pytest.approx(0.001)
    assert clock.to_local(5.0, 5.004) == pytest.approx(5.001)
    assert clock.to_local(WINDOW + 1.0, WINDOW + 1.006) == pytest.approx(WINDOW + 1.004)


def test_a_clock_that_was_set_is_measured_anew():
    clock = ClockOffset()
    clock.to_local(100.0, 1.0)
    assert clock.to_local(0.0, 2.003) == pytest.approx(2.003)
    assert clock.to_local(1.0, 3.001) == pytest.approx(3.001)
    assert clock.seconds == pytest.approx(2.001)
