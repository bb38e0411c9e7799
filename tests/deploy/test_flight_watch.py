"""The in-flight watch: pure judgements."""

import dataclasses
import math

import pytest

from deploy.flight.watch import Limits, Seen, Watch, inspect
from deploy.radio.supervisor import Supervisor
from tests.deploy.flight_bench import small_mission

LIMITS = Limits.of(small_mission())
FLYING = Supervisor(0x011E)
FINE = Seen("cf1", (1.0, 1.0, 0.6), 0.01, (1.0, 1.0, 0.6), FLYING, False, 0.01, "")
OTHER = dataclasses.replace(FINE, robot="cf2", position=(2.0, 1.0, 0.6), reference=(2.0, 1.0, 0.6))


def look(*drones):
    return [(finding.name, finding.robot, finding.level) for finding in inspect(LIMITS, drones)]


def test_nothing_is_wrong_with_a_good_flight():
    assert look(FINE, OTHER) == []


def test_the_fence_holds_workspace_pads_and_altitude():
    assert LIMITS.lower == pytest.approx((-0.3, -0.3, -0.3))
    assert LIMITS.upper == pytest.approx((2.8, 2.3, 0.9))


@pytest.mark.parametrize(
    ("change", "name", "level"),
    [
        ({"lost": "too many packets lost"}, "link", "abort"),
        ({"silence": 2.1}, "link", "abort"),
        ({"supervisor": Supervisor(0x003E)}, "supervisor", "abort"),  # tumbled
        ({"supervisor": Supervisor(0x0042)}, "supervisor", "abort"),  # locked
        ({"supervisor": Supervisor(0x0006)}, "supervisor", "abort"),  # cannot fly
        ({"age": 0.3}, "pose warning", "warning"),
        ({"age": 1.1}, "pose abort", "abort"),
        ({"position": None, "age": math.inf}, "pose abort", "abort"),
        ({"position": (1.0, 1.16, 0.6)}, "tracking warning", "warning"),
        ({"position": (1.0, 1.31, 0.6)}, "tracking abort", "abort"),
        ({"position": (1.0, 2.31, 0.6), "reference": None}, "geofence", "abort"),
        ({"position": (1.0, 1.0, 0.91), "reference": None}, "geofence", "abort"),
        ({"battery_low": True}, "battery", "abort"),
    ],
)
def test_each_condition_is_found_alone(change, name, level):
    assert look(dataclasses.replace(FINE, **change)) == [(name, "cf1", level)]


@pytest.mark.parametrize(("distance", "level"), [(0.26, None), (0.24, "warning"), (0.17, "abort")])
def test_separation_of_what_is_seen(distance, level):
    near = dataclasses.replace(OTHER, position=(1.0 + distance, 1.0, 0.6), reference=None)
    expected = [(f"separation {level}", "cf1–cf2", level)] if level else []
    assert look(FINE, near) == expected


def test_a_lost_drone_is_judged_by_its_link_alone():
    assert look(dataclasses.replace(FINE, lost="gone", position=None, battery_low=True)) == [("link", "cf1", "abort")]


def test_patience_forgives_one_bad_frame_but_not_many():
    off = dataclasses.replace(FINE, position=(1.0, 1.4, 0.6))
    watch = Watch(LIMITS)
    assert watch.look(0.00, [off]) == []
    assert watch.look(0.05, [FINE]) == []  # back again: the count starts anew
    assert watch.look(0.10, [off]) == []
    assert watch.look(0.29, [off]) == []
    (finding,) = watch.look(0.30, [off])
    assert finding.value == pytest.approx(0.4)
    assert watch.look(0.31, [off]) == []  # told once


def test_what_comes_back_is_told_again():
    old = dataclasses.replace(FINE, age=0.3)
    watch = Watch(LIMITS)
    told = [len(watch.look(t, [drone])) for t, drone in enumerate([old, old, FINE, old])]
    assert told == [1, 0, 0, 1]
