"""What is left of the radio for uploads."""

import dataclasses

from deploy.radio.telemetry import BLOCKS
from missions.flight import Flight
from missions.radio import TELEMETRY_BLOCKS, Radio, background_rate, drones_sharing, request_rate
from missions.schema import Robot
from tests.deploy.flight_bench import small_mission

LEFT = "radio://0/80/2M/E7E7E7E701"
TOO = "radio://0/90/2M/E7E7E7E702"
RIGHT = "radio://1/80/2M/E7E7E7E703"


def mission(*uris, **radio):
    robots = tuple(Robot(f"cf{number}", (0.5, 0.5), uri) for number, uri in enumerate(uris))
    return dataclasses.replace(small_mission(), robots=robots, radio=Radio(**radio), flight=Flight())


def test_telemetry_takes_as_many_packets_as_is_counted_on():
    assert len(BLOCKS.keys() - {"variance"}) == TELEMETRY_BLOCKS


def test_dongles_are_shared_by_number_whatever_the_channel():
    assert drones_sharing(mission(LEFT, TOO, RIGHT).robots) == (2, 2, 1)
    assert drones_sharing(mission(LEFT, "usb://0", "usb://1").robots) == (1, 1, 1)
    assert drones_sharing(mission("", "", RIGHT).robots) == (2, 2, 1)


def test_every_drone_of_a_dongle_gets_the_same_share_of_what_is_left():
    both = mission(LEFT, TOO, RIGHT)
    busy = background_rate(both)
    assert busy == 50.0 + 3 * 10.0 + 5.0
    assert request_rate(both) == ((250.0 - busy) / 2, (250.0 - busy) / 2, (500.0 - busy) / 2)
    assert request_rate(mission(LEFT, drones_per_dongle=4)) == ((125.0 - busy) / 2,)
    assert request_rate(mission(*[LEFT] * 6))[0] < 0.0
