"""The in-flight watch: pure judgements."""

import dataclasses
import math

import pytest

from deploy.flight.reactions import ORDER, policy_for, strongest
from deploy.flight.seen import Limits, Seen
from deploy.flight.separations import AHEAD, ahead
from deploy.flight.watch import Watch, inspect, tilt
from deploy.radio.supervisor import Supervisor
from missions.safety import Safety
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
        ({"silence": 0.6}, "link warning", "warning"),
        ({"untold": 2.1}, "link telemetry", "abort"),
        ({"voltage": 2.9}, "battery warning", "warning"),
        ({"voltage": 2.7}, "battery abort", "abort"),
        ({"tilt": 0.7}, "tilt warning", "warning"),
        ({"tilt": 1.0}, "tilt abort", "abort"),
        ({"velocity": (0.0, 1.7, 0.0)}, "geofence", "abort"),  # 1.44 m to stop, 1.3 m to the fence
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


def test_who_can_stop_inside_the_fence_may_be_fast():
    assert look(dataclasses.replace(FINE, velocity=(1.5, 1.5, 5.0))) == []
    outwards = dataclasses.replace(FINE, position=(2.7, 1.0, 0.6), reference=None, velocity=(-0.6, 0.0, 0.0))
    assert look(outwards) == []
    assert look(dataclasses.replace(outwards, velocity=(0.6, 0.0, 0.0))) == [("geofence", "cf1", "abort")]


def test_trajectories_that_are_followed_are_never_predicted_to_meet():
    now, drift, later = (1.0, 1.0, 0.6), (0.5, 0.0, 0.0), [(1.1, 1.0, 0.6), (1.1, 1.1, 0.6)]
    assert ahead(now, drift, now, drift, later) == tuple(later)
    off = ahead((1.0, 1.1, 0.6), (0.5, 0.5, 0.0), now, drift, later)  # 10 cm off, and leaving at 0.5 m/s
    for found, point, t in zip(off, later, AHEAD, strict=True):
        assert found == pytest.approx((point[0], point[1] + 0.1 + 0.5 * t, point[2]))


def test_who_is_about_to_be_too_near_is_found_before():
    near = dataclasses.replace(OTHER, position=(1.4, 1.0, 0.6), reference=None)
    towards = dataclasses.replace(near, ahead=lambda: ((1.3, 1.0, 0.6), (1.15, 1.0, 0.6)))
    still = dataclasses.replace(FINE, ahead=lambda: ((1.0, 1.0, 0.6), (1.0, 1.0, 0.6)))
    assert look(still, near) == []
    (finding,) = inspect(LIMITS, [still, towards])
    assert (finding.kind, finding.level) == ("separation", "abort")
    assert finding.text.startswith("0.15 m apart in 0.4 s")


def test_nobody_far_from_everybody_is_asked_where_he_will_be():
    def never():
        pytest.fail("asked")

    far = dataclasses.replace(OTHER, position=(1.0, 1.0 + 0.3 + LIMITS.closing * AHEAD[-1], 0.6), reference=None)
    asked = [dataclasses.replace(drone, ahead=never) for drone in (FINE, far)]
    assert inspect(dataclasses.replace(LIMITS, upper=(9.0, 9.0, 9.0)), asked) == []


def test_tilt_is_the_angle_between_the_verticals():
    assert tilt(0.0, 0.0) == 0.0
    assert tilt(0.3, 0.0) == pytest.approx(0.3)
    assert tilt(0.0, math.pi) == pytest.approx(math.pi)


def test_every_kind_of_finding_has_a_policy_and_the_strongest_wins():
    kinds = {"link", "supervisor", "pose", "tracking", "separation", "geofence", "battery", "tilt"}
    safety = Safety(battery="return", separation="stop_motors", pose="hold")
    assert {policy_for(safety, kind) for kind in kinds} <= set(ORDER)
    assert strongest(["hold", "return"]) == "return"
    assert strongest([policy_for(safety, kind) for kind in kinds]) == "stop_motors"
    every = [FINE, dataclasses.replace(FINE, lost="x"), dataclasses.replace(FINE, age=2.0)]
    assert {finding.kind for finding in inspect(LIMITS, every)} <= kinds
