"""What drones do when this computer is gone: what the README says."""

import dataclasses

import pytest

from deploy.clock import VirtualClock
from deploy.flight.keepalive import HUNG, PERIOD, Keepalive
from deploy.rehearsal import rehearse
from deploy.scenario.killed import HostDied
from deploy.scenario.load import parse_scenario
from missions.safety import Safety
from tests.deploy.flight_bench import small_plan
from tests.deploy.test_scenarios import MISSION

PLANS = {
    kind: small_plan(dataclasses.replace(MISSION, safety=Safety(on_host_loss=kind)))
    for kind in ("continue", "motor_stop")
}


def killed(folder, kind, at):
    """The flight's process is killed at ``at`` [s]; what every drone did then, or the outcome if it was over before."""
    text = f"name: kill\nevents:\n  - {{fault: process_kill, at: {at}, watch: 8.0}}\n"
    scenario = parse_scenario(text, path="kill.yaml", mission=MISSION)
    try:
        return rehearse(PLANS[kind], log_path=folder / f"{kind}-{at}.mcap", scenario=scenario)[0]
    except HostDied as death:
        return death


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path


def test_left_alone_they_fly_on(folder):
    death = killed(folder, "continue", 6.0)
    assert len(death.after) == 2
    assert all("was still at" in line and line.endswith("flying") for line in death.after)


def test_told_so_they_fall_a_second_later(folder):
    death = killed(folder, "motor_stop", 6.0)
    assert len(death.after) == 2
    for line in death.after:
        assert "was on the ground" in line
        seconds = float(line.split("on the ground ")[1].split()[0])
        assert 1.0 < seconds < 2.0  # a second of silence, and the fall


def test_a_whole_flight_with_the_watchdog_is_like_any_other(folder):
    outcome = killed(folder, "motor_stop", 500.0)
    assert outcome.completed, outcome


class Fed(dict):
    def __init__(self, *names):
        super().__init__(dict.fromkeys(names, self))
        self.times = []

    def feed_watchdog(self):
        self.times.append(self.clock.now())


def test_a_loop_that_hangs_is_no_sign_of_life():
    clock, fleet = VirtualClock(), Fed("cf1")
    fleet.clock, turned = clock, [0.0]
    keepalive = Keepalive(fleet, clock, lambda: turned[0])
    clock.sleep_until(1.0)
    assert not fleet.times
    keepalive.start()
    clock.sleep_until(HUNG + 3.0)
    assert fleet.times[-1] <= HUNG + 0.02  # the loop turned last at 0 s
    assert len(fleet.times) == pytest.approx((HUNG - 1.0) / PERIOD, abs=2)
    turned[0] = clock.now()
    clock.sleep_until(clock.now() + 1.0)
    assert fleet.times[-1] > HUNG + 3.0
    keepalive.stop()
    count = len(fleet.times)
    clock.sleep_until(clock.now() + 1.0)
    assert len(fleet.times) == count
