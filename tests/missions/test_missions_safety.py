"""The safety record: defaults that leave nobody behind, refusals that say where."""

import pytest

from missions import MissionError, parse_mission
from missions.safety import Safety
from tests.missions.test_missions_refusals import ONE


def parse(safety):
    return parse_mission(f"{ONE}\nsafety: {safety}\n", path="m.yaml", read_file=lambda name: b"")


def test_by_default_nobody_is_left_behind_and_every_finding_lands_everybody():
    safety = Safety()
    assert safety.min_robots is None
    assert safety.on_host_loss == "continue"
    kinds = ("link", "supervisor", "pose", "tracking", "separation", "geofence", "battery", "tilt")
    assert {getattr(safety, kind) for kind in kinds} == {"land_all"}


def test_what_is_stated_is_read():
    read = parse("{min_robots: 1, on_host_loss: motor_stop, battery: return, tilt_limit: 0.5}").safety
    assert (read.min_robots, read.on_host_loss, read.battery, read.tilt_limit) == (1, "motor_stop", "return", 0.5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{min_robots: 2}", r"safety\.min_robots: got 2; allowed: at most 1, as many robots as there are"),
        ("{min_robots: 0}", r"safety\.min_robots: got 0; allowed: at least 1"),
        ("{on_host_loss: land}", r"safety\.on_host_loss: got 'land'; allowed: .*motor_stop"),
        ("{battery: panic}", r"safety\.battery: got 'panic'; allowed: .*land_all"),
        ("{baterry: hold}", r"safety.*baterry.*battery"),
        ("{tilt_limit: 3.0}", r"safety\.tilt_limit: got 3\.0; allowed: "),
    ],
)
def test_refusals_say_where_and_what_is_allowed(text, message):
    with pytest.raises(MissionError, match=message):
        parse(text)
