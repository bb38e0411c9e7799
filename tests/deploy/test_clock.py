import inspect
import threading
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from deploy.clock import SystemClock, VirtualClock
from tests.contracts import clock as contract

CONTRACT = [f for _, f in inspect.getmembers(contract, inspect.isfunction) if f.__module__ == contract.__name__]


@pytest.mark.parametrize("check", CONTRACT, ids=lambda f: f.__name__)
@pytest.mark.parametrize("make", [SystemClock, VirtualClock, lambda: VirtualClock(tick=0.0007)])
def test_clocks_meet_the_contract(make, check):
    check(make())


class World:
    """Records what the clock does with it."""

    def __init__(self, clock, settles=True):
        self.clock, self.settles, self.calls = clock, settles, []
        clock.attach(self.advance, self.settle)

    def advance(self, t):
        assert t == self.clock.now()  # who is called from a world reads the same time
        self.calls.append(t)

    def settle(self, timeout):
        self.calls.append("settle")
        return self.settles

    @property
    def times(self):
        return [call for call in self.calls if call != "settle"]


@given(st.lists(st.floats(0.0, 0.2), min_size=1, max_size=8))
def test_ticks_stay_on_multiples_of_the_tick_whatever_the_deadlines(naps):
    clock = VirtualClock(tick=0.01)
    world = World(clock)
    deadlines = []
    for nap in naps:
        deadlines.append(clock.now() + nap)
        clock.sleep_until(deadlines[-1])
        assert clock.now() >= deadlines[-1]
    assert world.times == sorted(world.times)
    ends = world.times[-1:] + deadlines
    for k in range(1, int(max(ends) / 0.01 - 1e-6) + 1):
        assert any(t == pytest.approx(k * 0.01, abs=2e-9) for t in world.times)  # no tick is skipped
    for t in world.times:
        on_tick = abs(t / 0.01 - round(t / 0.01)) < 1e-6
        assert on_tick or any(abs(t - d) < 2e-9 for d in deadlines)


def test_worlds_settle_before_every_tick():
    clock = VirtualClock(tick=0.01)
    world = World(clock)
    clock.sleep_until(0.03)
    assert world.calls == ["settle", 0.01, "settle", 0.02, "settle", 0.03]
    assert clock.stalls == 0


def test_ten_thousand_ticks_do_not_drift():
    clock = VirtualClock(tick=0.01)
    for k in range(1, 10001):
        clock.sleep_until(k * 0.01)
    assert clock.now() == 100.0


def test_time_stands_while_a_worker_holds_it():
    clock = VirtualClock(tick=0.01)
    world = World(clock)
    entered, leave, seen = threading.Event(), threading.Event(), []

    def work():
        with clock.hold():
            entered.set()
            leave.wait(10.0)
            seen.append(clock.now())

    worker = threading.Thread(target=work)
    worker.start()
    assert entered.wait(10.0)
    flight = threading.Thread(target=clock.sleep_until, args=(0.05,))
    flight.start()
    flight.join(0.05)
    assert flight.is_alive()
    assert not world.times
    leave.set()
    worker.join(10.0)
    flight.join(10.0)
    assert seen == [0.0]
    assert clock.now() == 0.05


def test_a_hold_that_begins_while_the_world_settles_stops_the_tick():
    clock = VirtualClock(tick=0.01)
    held, release = threading.Event(), threading.Event()

    def hold():
        with clock.hold():
            held.set()
            release.wait(10.0)

    worker = threading.Thread(target=hold)
    inside = []

    def settle(timeout):
        if not worker.ident:
            worker.start()
            held.wait(10.0)
            threading.Timer(0.05, release.set).start()
        return True

    clock.attach(lambda t: inside.append(release.is_set()), settle)
    clock.sleep_until(0.01)
    worker.join(10.0)
    assert inside == [True]


def test_an_endless_hold_and_an_unsettled_world_are_overrun_and_counted():
    clock = VirtualClock(tick=0.01, patience=0.02)
    leave = threading.Event()
    entered = threading.Event()

    def work():
        with clock.hold():
            entered.set()
            leave.wait(10.0)

    worker = threading.Thread(target=work)
    worker.start()
    entered.wait(10.0)
    clock.sleep_until(0.02)
    assert clock.now() == 0.02
    assert clock.stalls == 2
    leave.set()
    worker.join(10.0)
    World(clock, settles=False)
    clock.sleep_until(0.03)
    assert clock.stalls == 3


def test_sleeping_inside_ones_own_hold_is_refused_instead_of_waiting_for_oneself():
    clock = VirtualClock()
    with clock.hold(), pytest.raises(RuntimeError, match="held"):
        clock.sleep_until(1.0)
    clock.sleep_until(0.01)
    assert clock.now() == 0.01


def test_an_error_of_a_world_reaches_the_flight_and_releases_the_clock():
    clock = VirtualClock()

    def advance(t):
        raise ZeroDivisionError

    clock.attach(advance, lambda timeout: True)
    with pytest.raises(ZeroDivisionError):
        clock.sleep_until(1.0)
    with clock.hold():
        pass


def test_speed_limits_how_fast_time_passes():
    clock = VirtualClock(tick=0.01, speed=10.0)
    began = time.monotonic()
    clock.sleep_until(1.0)
    assert time.monotonic() - began >= 0.09


def test_without_a_speed_limit_a_minute_passes_at_once():
    clock = VirtualClock()
    began = time.monotonic()
    clock.sleep_until(60.0)
    assert time.monotonic() - began < 5.0


@pytest.mark.parametrize("options", [{"tick": 0.0}, {"speed": 0.0}, {"speed": -1.0}])
def test_clocks_that_cannot_run_are_refused(options):
    with pytest.raises(ValueError, match="positive"):
        VirtualClock(**options)


def test_epochs():
    assert VirtualClock(epoch=12.5).epoch == 12.5
    assert abs(SystemClock().epoch - time.time()) < 1.0


def test_what_was_done_while_the_clock_stood_is_owed_until_it_has_passed():
    clock, debts = VirtualClock(), [0.0]
    clock.attach(lambda t: None, lambda timeout: True, lambda: debts.pop() if debts else 0.0)
    assert not clock.owes()
    with clock.hold():
        debts.append(0.05)
        assert not clock.owes()  # nobody knows yet how much it will be
    assert clock.owes()
    clock.sleep_until(0.04)
    assert clock.owes()
    clock.sleep_until(0.05)
    assert not clock.owes()
