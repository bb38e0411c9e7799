"""Nothing lasts for ever: every phase has a deadline, and something happens when it is over."""

import dataclasses
import threading

import pytest

from deploy.clock import SystemClock
from deploy.errors import FlightAborted, LinkError
from deploy.flight import abort, deadlines
from deploy.flight.deadlines import BACKSTOP, Deadline, Overdue, planned
from deploy.flight.loop import Flight
from deploy.operator import Interrupts
from deploy.phases import AIRBORNE, TABLE, Phase
from deploy.radio.fleet import Fleet
from tests.deploy.flight_bench import fly_on, small_plan, stage

PLAN = small_plan()
SHORT = 0.5  # s
GROUND = [Phase.CHECKED, Phase.ARMED]  # the loop asks no phase for its name; these two cost least
AIR = sorted(AIRBORNE - {Phase.ABORTING}, key=list(Phase).index)


@pytest.fixture
def bench(tmp_path, cache, monkeypatch):
    def run(stuck, **kwargs):
        """Fly; a flight that enters the phase ``stuck`` is kept there by a bug."""
        entered, enter = {}, Flight.enter

        def never_go_on(flight, phase):
            enter(flight, phase)
            entered[phase] = flight.clock.now()
            while phase is stuck and phase is not Phase.ABORTING:
                flight.tick()

        monkeypatch.setattr(Flight, "enter", never_go_on)
        # Who lands needs the time that landing takes, also when everybody is brought down.
        allowance = TABLE[stuck].allowance if stuck is Phase.LANDING else SHORT
        short = dataclasses.replace(TABLE[stuck], allowance=allowance)
        monkeypatch.setattr(deadlines, "TABLE", {**TABLE, stuck: short})  # waiting is what costs time here
        with stage(tmp_path, PLAN) as ready:
            try:
                outcome = fly_on(ready, PLAN, cache, **kwargs)
            except FlightAborted as error:
                outcome = error
            assert not ready.world.motors.any()
            return outcome, entered, ready

    return run


def test_a_deadline_is_what_it_takes_and_the_allowance_and_is_told_once():
    deadline = Deadline()
    deadline.check(1e9)  # nothing is under way
    deadline.begin(10.0, Phase.SETTLING, 3.0)
    due = 10.0 + 3.0 + TABLE[Phase.SETTLING].allowance
    assert deadline.left(10.5) == pytest.approx(due - 10.5)
    assert deadline.left(due + 1.0) == 0.0
    deadline.check(due + BACKSTOP)
    with pytest.raises(Overdue, match=r"settling: not over within 8\.0 s"):
        deadline.check(due + BACKSTOP + 0.01)
    deadline.check(due + 100.0)


def test_a_plan_takes_what_its_moves_take():
    takes = {phase: planned(PLAN, phase, 3.0) for phase in Phase}
    assert {phase for phase, time in takes.items() if time} == {
        Phase.TAKING_OFF, Phase.TRANSFERRING, Phase.SETTLING, Phase.ON_MISSION, Phase.HOLDING, Phase.RETURNING
    }  # fmt: skip
    assert takes[Phase.TAKING_OFF] == PLAN.mission.flight.takeoff_duration
    assert takes[Phase.ON_MISSION] == 3.0


def test_every_phase_says_what_happens_when_its_time_is_up():
    assert all(rule.late for rule in TABLE.values() if rule.next is not None)
    assert all(rule.allowance > 0.0 for rule in TABLE.values() if rule.next is not None)


@pytest.mark.parametrize("phase", AIR, ids=lambda phase: phase.name)
def test_a_phase_in_the_air_that_does_not_end_lands_everybody(bench, phase):
    outcome, entered, _ = bench(phase)
    assert outcome.phase is Phase.ABORTED
    assert f"{phase.value}: not over within" in outcome.reason
    assert all(outcome.landed.values())
    if phase is not Phase.LANDING:
        late = entered[Phase.ABORTING] - entered[phase] - planned(PLAN, phase, 3.0) - SHORT
        assert 0.0 < late - BACKSTOP < 0.05


@pytest.mark.parametrize("phase", GROUND, ids=lambda phase: phase.name)
def test_a_phase_on_the_ground_that_does_not_end_cancels_the_flight(bench, phase):
    outcome, entered, _ = bench(phase)
    assert isinstance(outcome, Overdue)
    late = entered[Phase.CANCELLED] - entered[phase] - SHORT
    assert 0.0 < late - BACKSTOP < 0.05


@pytest.mark.parametrize("part", ["brake", "fly", "land_in_turn"])
def test_an_early_end_that_does_not_come_to_an_end_lands_everybody_where_he_is(bench, monkeypatch, part):
    def for_ever(flight, *args):
        while True:
            flight.tick()

    monkeypatch.setattr(abort, part, for_ever)
    operator = Interrupts()

    def observe(status):
        if status.mission_time >= 1.0 and status.phase is Phase.ON_MISSION:
            operator.say("abort")

    outcome, _, _ = bench(Phase.ABORTING, operator=operator, observer=observe)
    assert outcome.phase is Phase.ABORTED
    assert all(outcome.landed.values())
    assert any("aborting: not over within" in fault for fault in outcome.faults)


class Slow:
    """A drone that answers only when its link is closed."""

    def __init__(self, name):
        self.name, self._closed = name, threading.Event()

    def close(self, *, force=False):
        assert force
        self._closed.set()

    def work(self):
        self._closed.wait(5.0)
        raise LinkError(f"{self.name}: no link any more")


def test_who_is_not_done_in_time_is_cut_off_and_has_failed():
    clock = SystemClock()
    fleet = Fleet([Slow("cf1"), Slow("cf2")], clock)

    def act(drone):
        return "done" if drone.name == "cf1" else drone.work()

    results, failures = fleet.attempt(act, lambda: clock.sleep_until(clock.now() + 0.01), within=0.05)
    assert results == {"cf1": "done"}
    assert {name: str(error) for name, error in failures.items()} == {"cf2": "cf2: not done within 0 s"}
