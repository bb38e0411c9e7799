"""Signals, hardware without a radio, and commands with answers."""

import os
import signal

import pytest

from deploy.errors import LinkError
from deploy.hardware import fly_hardware, uris_of
from deploy.operator import Interrupts, interrupts
from deploy.radio.drivers import require_crazyradio
from deploy.watch import Watch
from missions.schema import Robot
from tests.deploy.flight_bench import small_mission, small_plan


def test_one_signal_lands_two_stop():
    operator = Interrupts()
    assert (operator.land_requested(), operator.stop_requested()) == (False, False)
    operator.request()
    assert (operator.land_requested(), operator.stop_requested()) == (True, False)
    operator.request()
    assert (operator.land_requested(), operator.stop_requested()) == (True, True)


def test_ctrl_c_is_caught_inside_and_given_back_outside():
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    with interrupts() as operator:
        os.kill(os.getpid(), signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGTERM)
        assert (operator.land_requested(), operator.stop_requested()) == (True, False)
        os.kill(os.getpid(), signal.SIGINT)
        assert operator.stop_requested()
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


def plan_with(*uris):
    robots = tuple(Robot(f"cf{i}", (0.5 + i, 0.5), uri) for i, uri in enumerate(uris))
    return type("Mission", (), {"robots": robots})


def test_every_robot_needs_a_uri_of_its_own():
    with pytest.raises(LinkError, match="no uri for cf1"):
        uris_of(plan_with("radio://0/80/2M/E7E7E7E701", ""))
    with pytest.raises(LinkError, match=r"same uri: radio://0/80"):
        uris_of(plan_with("radio://0/80", "radio://0/80"))


@pytest.mark.parametrize("answer", [(), OSError("no backend")])
def test_no_radio_is_one_clear_line(monkeypatch, tmp_path, answer):
    def serials():
        if isinstance(answer, Exception):
            raise answer
        return answer

    monkeypatch.setattr("cflib.drivers.crazyradio.get_serials", serials)
    with pytest.raises(LinkError, match="no Crazyradio found: plug one in"):
        require_crazyradio()
    import dataclasses

    mission = small_mission()
    robots = tuple(dataclasses.replace(r, uri=f"radio://0/80/2M/E7E7E7E70{i}") for i, r in enumerate(mission.robots))
    plan = dataclasses.replace(small_plan(mission), mission=dataclasses.replace(mission, robots=robots))
    with pytest.raises(LinkError, match="no Crazyradio found"):
        fly_hardware(plan, log_path=tmp_path / "x.mcap", mocap=lambda clock: None, watch=Watch(Interrupts()))
    assert not list(tmp_path.iterdir())
