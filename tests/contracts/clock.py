"""What every clock must do: plain functions that take a clock."""

from __future__ import annotations

from deploy.clock import Clock

SHORT = 0.003  # [s]


def never_goes_back(clock: Clock) -> None:
    readings = []
    for _ in range(5):
        readings.append(clock.now())
        clock.sleep_until(clock.now() + SHORT / 5)
    assert readings == sorted(readings)
    assert readings[0] >= 0.0


def sleeps_until_the_deadline(clock: Clock) -> None:
    deadline = clock.now() + SHORT
    clock.sleep_until(deadline)
    assert clock.now() >= deadline - 1e-9


def a_deadline_in_the_past_returns_at_once(clock: Clock) -> None:
    clock.sleep_until(clock.now() + SHORT)
    before = clock.now()
    clock.sleep_until(before - 1.0)
    assert clock.now() - before < 1.0


def can_be_held_and_held_again(clock: Clock) -> None:
    with clock.hold(), clock.hold():
        before = clock.now()
    clock.sleep_until(before + SHORT)
    assert clock.now() >= before + SHORT - 1e-9


def owes_nothing_for_work_without_packets(clock: Clock) -> None:
    with clock.hold():
        pass
    assert not clock.owes()


def epoch_is_a_constant(clock: Clock) -> None:
    before = clock.epoch
    clock.sleep_until(clock.now() + SHORT)
    assert clock.epoch == before


def repeats_what_it_is_told_until_it_is_stopped(clock: Clock) -> None:
    told: list[float] = []
    stop = clock.every(SHORT, lambda: told.append(clock.now()))
    clock.sleep_until(clock.now() + 60 * SHORT)
    stop()
    clock.sleep_until(clock.now() + 2 * SHORT)
    count = len(told)
    assert 3 <= count <= 64
    clock.sleep_until(clock.now() + 10 * SHORT)
    assert len(told) == count
